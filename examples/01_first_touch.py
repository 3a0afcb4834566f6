"""Press a ball into a GelSight Mini, look at the tactile image, and relight it."""

import optisense as ots

sensor = ots.load("gelsight-mini")
model = ots.OpticalModel(sensor)
ball = ots.Contact(ots.Sphere(radius=1.5), at=(0.0, 0.0), depth=0.8)
image = model.render([ball], resolution=(320, 240))
image.save("touch")  # image.png, radiance.exr, normals.npy, contact_mask.npy, layers/

# Linear radiance has the shape (h, w, 3) and the unit mW/(mm^2 sr).
print("mean radiance of R, G, B:", image.radiance.mean(axis=(0, 1)).round(4))
print(f"touched: {image.contact_mask.mean():.1%} of the picture")

# The light of each group is kept, so that other powers need no new rendering.
image.relight({"red": 2.0 * sensor.lights["red"].channel_flux()}).save("twice-the-red")
