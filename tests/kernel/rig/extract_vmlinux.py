"""extract_vmlinux.py VMLINUZ VMLINUX: the ELF kernel out of a compressed bzImage.

QEMU boots the ELF file directly, which saves the firmware and the decompression: seconds under emulation.
"""
import subprocess
import sys

PACKERS = (
    (b"\xfd7zXZ\0", ["xz", "-dc"]),
    (b"\x28\xb5\x2f\xfd", ["zstd", "-dc"]),
    (b"\x1f\x8b\x08", ["gzip", "-dc"]),
    (b"\x02\x21\x4c\x18", ["lz4", "-dc"]),
)


def unpacked(image):
    """The first compressed stream in the image that holds an ELF file; what follows the stream is ignored."""
    for magic, command in PACKERS:
        start = image.find(magic)
        while start >= 0:
            try:
                out = subprocess.run(command, input=image[start:], capture_output=True).stdout
            except FileNotFoundError:
                break
            if out[:4] == b"\x7fELF":
                return out
            start = image.find(magic, start + 1)
    return None


def main():
    source, target = sys.argv[1:3]
    with open(source, "rb") as file:
        kernel = unpacked(file.read())
    if kernel is None:
        sys.exit(f"{source}: no ELF kernel found inside (is zstd or lz4 missing?)")
    with open(target, "wb") as file:
        file.write(kernel)


main()
