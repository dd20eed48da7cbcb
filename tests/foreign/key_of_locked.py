#!/usr/bin/python3 -I
"""The key to a seed of locked_ins.py, as its owner computes it: seed on standard input, key out."""
key = 0x5EC0DE17
for byte in bytes.fromhex(input()):
    for _ in range(bin(byte).count("1")):
        key = key * 2 % 2**32 + key // 2**31
    key ^= int.from_bytes(bytes([byte] * 4), "big")
print(f"{key:08x}")
