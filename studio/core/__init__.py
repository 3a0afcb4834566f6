"""What the extension computes, without bpy: numbers, poses, cages, meshes, the engine's process."""
