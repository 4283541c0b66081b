"""--shard I/N of the suites: every N-th piece of work, so that an engine shares them out (tests/README.md)."""

import argparse


def add_shard(parser):
    parser.add_argument("--shard", type=shard, default=(1, 1), metavar="I/N", help="every N-th from the I-th on")


def shard(text):
    try:
        i, n = map(int, text.split("/"))
    except ValueError:
        i, n = 0, 0
    if not 1 <= i <= n:
        raise argparse.ArgumentTypeError(f"{text} must be I/N with whole numbers, 1 <= I <= N")
    return i, n


def in_shard(number, part):
    """Whether piece `number`, from 0, belongs to the part (I, N)."""
    return number % part[1] == part[0] % part[1]
