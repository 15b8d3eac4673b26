"""Leaves that every room uses: words, messages, files, progress, threads and processes, compiling."""
