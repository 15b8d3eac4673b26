"""Basics that all other packages use: wording, messages, files, progress, threads and processes, compiling."""
