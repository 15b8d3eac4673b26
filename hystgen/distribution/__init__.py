"""Models as binaries for other programs: shared libraries and co-simulation units, compiled with zig."""
