"""A C program that replays recorded calls of an emitted model, shared by tests that observe its run."""

_MAIN = """\
#include "{name}.h"
#include <stdio.h>
{replays}int main(int count, char **words)
{{
    return count > 1 && words[1][0] == 'f' ? forward() : inverse();
}}
"""

_REPLAY = """\
static int {op}(void)
{{
    static {name}_{op}_t self;
    int call;
    {name}_real_t x;
    {name}_{op}_init(&self);
    while ((call = getchar()) != EOF && fread(&x, sizeof x, 1, stdin) == 1) {{
        switch (call & 127) {{
        case 0: (void){name}_{op}_step(&self, x); break;
        case 1: {commit} break;
        case 2: {name}_{op}_reset(&self, x); break;
        default: {name}_{op}_init(&self); break;
        }}
        if (call < 128) {{
            (void){name}_{op}_status(&self);
        }}
    }}
    return 0;
}}
"""


def c_main(name: str) -> str:
    """Text of the program for the model `name`, whose argument is an operator. For each call it reads a byte, 128 or
    more if the status is not to be read, and a number for the argument."""
    commits = {"forward": "", "inverse": f"{name}_inverse_commit(&self, x);"}
    replays = "".join(_REPLAY.format(name=name, op=op, commit=commit) for op, commit in commits.items())
    return _MAIN.format(name=name, replays=replays)
