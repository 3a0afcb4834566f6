"""The camera: `projection` turns pixels into rays, `response` turns radiance into a picture."""
