"""`python -m hystgen`: runs the command line in this interpreter, regardless of which `hystgen` is on the path."""

from hystgen.cli import main

if __name__ == "__main__":
    main(prog_name="hystgen")
