"""`python -m hystgen`: the command line of this interpreter, whatever `hystgen` is on the path."""

from hystgen.cli import main

main(prog_name="hystgen")
