"""Bytes into text: encodings, byte order marks and line ends; in blocks, so that any file takes little memory."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from typing import IO

from hystgen.records.reading import Reading

BLOCK = 1 << 20
"""Bytes read at a time; a longer line is none of a text table."""

WIDE = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
"""Encodings by the byte order mark that a file begins with."""

LOOKED_AT = 1 << 10
"""Bytes at the start of a file that show UTF-16 without a byte order mark."""


def texts(reading: Reading, stream: IO[bytes]) -> Iterator[str]:
    """The file's text in blocks of whole lines that end in a line feed, as every line does but perhaps the last."""
    latin = False
    for data in _blocks(reading, _eight_bit(reading, stream)):
        if b"\0" in data:
            raise reading.refuse("is not a text file; export CSV, .npz, .h5, Parquet or MATLAB .mat")
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
            if not latin:
                reading.notes.append("the text is not UTF-8; it was read as Latin-1")
            latin = True
        if "\r" in text:
            text = text.replace("\r\n", "\n").replace("\r", "\n")
        yield text


def _eight_bit(reading: Reading, stream: IO[bytes]) -> Iterator[bytes]:
    """The bytes of the file without its byte order mark, those of UTF-16 as UTF-8."""
    data = stream.read(BLOCK)
    mark, encoding = next(((mark, name) for mark, name in WIDE.items() if data.startswith(mark)), (b"", ""))
    encoding = encoding or _wide_without_mark(data[:LOOKED_AT])
    data = data[len(mark) :]
    if not encoding.startswith("utf-16"):
        while data:
            yield data
            data = stream.read(BLOCK)
        return
    reading.understood(encoding[:6].upper())
    decoder = codecs.getincrementaldecoder(encoding)("strict")
    while True:
        try:
            text = decoder.decode(data, final=not data)
        except UnicodeDecodeError:
            raise reading.refuse("is damaged UTF-16 text; export it again, as UTF-8") from None
        if text:
            yield text.encode("utf-8", "surrogatepass")
        if not data:
            return
        data = stream.read(BLOCK)


def _wide_without_mark(start: bytes) -> str:
    """UTF-16 when every other byte is zero, as in text that is mostly digits; else nothing."""
    pairs = len(start) // 2
    for encoding, zeros, others in (
        ("utf-16-le", start[1::2].count(0), start[: 2 * pairs : 2].count(0)),
        ("utf-16-be", start[: 2 * pairs : 2].count(0), start[1::2].count(0)),
    ):
        if pairs and not others and zeros > 0.9 * pairs:
            return encoding
    return ""


def _blocks(reading: Reading, chunks: Iterator[bytes]) -> Iterator[bytes]:
    rest = b""
    for data in chunks:
        data = rest + data
        # A carriage return at the end may be the first half of a line end
        end = max(data.rfind(b"\n"), data.rfind(b"\r", 0, -1)) + 1
        if end:
            yield data[:end]
        rest = data[end:]
        if len(rest) > BLOCK:
            raise reading.refuse(f"has a line of more than {BLOCK >> 20} MB; export one row a line")
    if rest:
        yield rest
