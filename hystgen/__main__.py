"""`python -m hystgen`: the command line of this interpreter, whatever `hystgen` is on the path."""

from hystgen.cli import main

if __name__ == "__main__":
    main(prog_name="hystgen")
