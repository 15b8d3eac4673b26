"""Limits on a model's name, the prefix of its C symbols, and on the length of unit names."""

from __future__ import annotations

import re

from hystgen.basics.problems import printable

MAX_NAME = 40
NAME_PATTERN = "^[A-Za-z](_?[A-Za-z0-9])*$"
"""Letters and digits with single underscores between them, starting with a letter."""

MAX_UNIT = 40
"""[characters] Maximum length of a unit name. A parameter file refuses longer ones, so longer text in the header of a
recording is not taken for a unit."""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_NAME = re.compile(NAME_PATTERN.rstrip("$") + r"\Z")

# C up to C23 and C++ up to C++23; keywords with a leading underscore cannot be model names anyway.
KEYWORDS = _words(
    """
    alignas alignof and and_eq asm auto bitand bitor bool break case catch char char16_t char32_t char8_t class
    co_await co_return co_yield compl concept const const_cast consteval constexpr constinit continue decltype
    default delete do double dynamic_cast else enum explicit export extern false float for friend goto if inline
    int long mutable namespace new noexcept not not_eq nullptr operator or or_eq private protected public register
    reinterpret_cast requires restrict return short signed sizeof static static_assert static_cast struct switch
    template this thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using
    virtual void volatile wchar_t while xor xor_eq
    """
)

# On an include path, NAME.h would be found instead of the system's header of that name.
_HEADERS = _words(
    """
    aio alloca arduino assert complex cpio ctype dirent dlfcn endian errno fcntl fenv float fmtmsg fnmatch ftw
    getopt glob grp iconv ifaddrs inttypes io iso646 langinfo libgen libintl limits locale malloc math memory
    monetary mqueue ndbm netdb nl_types poll pthread pwd regex sched search semaphore setjmp signal spawn stdalign
    stdarg stdatomic stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string strings syslog tar
    termios tgmath threads time uchar ulimit unistd utime utmpx wchar wctype windows winsock wordexp
    """
)

_DEVICES = frozenset(["con", "prn", "aux", "nul", *(f"{port}{i}" for port in ("com", "lpt") for i in range(10))])

# The macros UPPER_... of a model with one of these names would clash with those of a standard header. Names in the
# first group are also forbidden when an underscore and more follow, those in the second only on their own.
_MACRO_FAMILIES = dict.fromkeys(_words("dbl dec dec32 dec64 dec128 flt ldbl"), "float")
_MACRO_NAMES = (
    dict.fromkeys(_words("ptrdiff sig_atomic size wchar wint intptr uintptr intmax uintmax"), "stdint")
    | {f"{u}int{k}{bits}": "stdint" for u in ("", "u") for k in ("", "_least", "_fast") for bits in (8, 16, 32, 64)}
    | dict.fromkeys(_words("char schar uchar shrt ushrt int uint long ulong llong ullong bool mb mb_len"), "limits")
    | {"fe": "fenv", "fp": "math", "lc": "locale", "sig": "signal", "pri": "inttypes", "scn": "inttypes"}
    | {"atomic": "stdatomic", "clocks": "time", "exit": "stdlib", "rand": "stdlib"}
)


def name_problem(name: str) -> str | None:
    """The fault in a model's name and how to fix it; None if the name is usable.

    A name is the prefix of every emitted symbol (`NAME_...`) and, in upper case, of every macro, and it names
    the files `NAME.h`, `NAME.c` and `NAME_selftest.h/.c`. Case is ignored in every comparison, because macros
    are in upper case and some file systems do not distinguish cases.
    """
    if not name:
        return "is empty; give a name such as stage_x"
    if len(name) > MAX_NAME:
        return f"has {len(name)} characters, more than {MAX_NAME}; shorten it"
    if not _NAME.match(name):
        rule = "use letters, digits and single underscores between them, starting with a letter"
        return f'"{printable(name)}" is not a usable C prefix; {rule}'
    word = name.lower()
    other = f"choose another name, such as axis_{word}" if len(name) + 5 <= MAX_NAME else "choose another name"
    if word in KEYWORDS:
        return f"{name} is a keyword of C or C++; {other}"
    if word == "main":
        return "main would write main.h and main.c, which are the firmware's own; choose another name"
    if word in _HEADERS:
        return f"{name}.h would hide the system's header <{word}.h>; {other}"
    if word in _DEVICES:
        return f"{name} is a device name on Windows, where {name}.h cannot be written; {other}"
    if word == "hystgen" or word.startswith("hystgen_"):
        return f"{name} begins with hystgen, the prefix of the shared run time; choose another name"
    if word.endswith("_selftest"):
        return f"{name}.h is the self-test of a model named {name[:-9]}; choose another name"
    family = next((f for f in _MACRO_FAMILIES if word == f or word.startswith(f + "_")), None)
    header = _MACRO_FAMILIES[family] if family else _MACRO_NAMES.get(word)
    if header:
        return f"the macros {(family or word).upper()}_... belong to <{header}.h>; {other}"
    return None
