"""The extension's computations without bpy: numbers, poses, cages, meshes, the engine's process."""
