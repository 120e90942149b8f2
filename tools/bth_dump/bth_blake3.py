"""BLAKE3, from the `blake3` package where it is installed, else in slow plain Python (256-bit hashes)."""

import struct

IV = (0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19)
PERMUTATION = (2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8)
CHUNK_START, CHUNK_END, PARENT, ROOT = 1, 2, 4, 8
COLUMNS = ((0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15))
DIAGONALS = ((0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14))
MASK = 0xFFFFFFFF


def _compress(chaining, block, counter, length, flags):
    v = [*chaining, *IV[:4], counter & MASK, counter >> 32, length, flags]
    m = struct.unpack("<16I", block)
    for _ in range(7):
        for i, (a, b, c, d) in enumerate(COLUMNS + DIAGONALS):
            for word, r1, r2 in ((m[2 * i], 16, 12), (m[2 * i + 1], 8, 7)):
                v[a] = (v[a] + v[b] + word) & MASK
                x = v[d] ^ v[a]
                v[d] = (x >> r1 | x << 32 - r1) & MASK
                v[c] = (v[c] + v[d]) & MASK
                x = v[b] ^ v[c]
                v[b] = (x >> r2 | x << 32 - r2) & MASK
        m = [m[i] for i in PERMUTATION]
    return [v[i] ^ v[i + 8] for i in range(8)]


def _chunk(data, index, root):
    chaining = IV
    blocks = [data[i : i + 64] for i in range(0, len(data), 64)] or [b""]
    for i, block in enumerate(blocks):
        last = i == len(blocks) - 1
        flags = (CHUNK_START if i == 0 else 0) | (CHUNK_END | root if last else 0)
        chaining = _compress(chaining, block.ljust(64, b"\0"), index, len(block), flags)
    return chaining


def _tree(data, index, root):
    chunks = max(1, (len(data) + 1023) // 1024)
    if chunks == 1:
        return _chunk(data, index, root)
    left = 1 << (chunks - 1).bit_length() - 1
    block = _tree(data[: left * 1024], index, 0) + _tree(data[left * 1024 :], index + left, 0)
    return _compress(IV, struct.pack("<16I", *block), 0, 64, PARENT | root)


def plain_blake3(data):
    return struct.pack("<8I", *_tree(data, 0, ROOT))


try:
    from blake3 import blake3 as _blake3

    def blake3(data):
        return _blake3(data).digest()

except ImportError:
    blake3 = plain_blake3
