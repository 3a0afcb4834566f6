"""The extension in a real Blender window, driven by mouse and keys: `make studio-window-test`."""
