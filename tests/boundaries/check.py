#!/usr/bin/env python3
"""Holds the source tree to its module boundaries: python3 check.py ROOT

Reads every #include of our own code and prints one line, "file:line: what", for each that points against the
arrows below; then checks that no file is too long, that each folder of the top level explains itself, that no identifier
of our own INS's profile stands in C++ outside of tests, and that no two types of one namespace have one name: the linker takes
what it has of either for the other.
Exit status 1 if anything was found.
"""
import re
import sys
from pathlib import Path

# What every codec may know: how errors are told, how bytes are ordered, what a frame and a deadline are.
BYTES = ["protocol/error.hpp", "protocol/byte_order.hpp", "protocol/time.hpp", "protocol/can/frame.hpp"]

# A module is the longest of these prefixes that a path begins with. What it may include, besides itself:
MAY_INCLUDE = {
    "estimator/geometry": [],
    "estimator/models": ["estimator/geometry"],
    "estimator/filter": ["estimator/geometry", "estimator/models"],
    "estimator/navigation": ["estimator/geometry", "estimator/models", "estimator/filter"],
    "estimator/statistics": [],
    "estimator/fleet": ["estimator/statistics"],
    "estimator/passes": ["estimator/geometry", "estimator/models", "estimator/filter", "estimator/navigation",
                         "estimator/statistics"],
    "estimator": ["estimator"],  # planning, diagnosis: on top of all the others
    "protocol": ["protocol", "estimator/geometry"],
    "protocol/flash": [*BYTES],
    "protocol/ins_interface": [*BYTES, "protocol/flash"],
    "protocol/isotp": [*BYTES],
    "protocol/uds": [*BYTES, "protocol/isotp"],
    # A fault of the estimator must not be repeated in the truth that it is measured against.
    "sim_ins": ["protocol", "estimator/geometry"],
    # The rooms of the daemon: host <- ins, store <- estimate <- run <- what stands in daemon/ itself.
    "daemon/host": ["protocol", "estimator/geometry"],
    "daemon/ins": ["daemon/host", "protocol", "estimator/geometry"],
    "daemon/store": ["daemon/host", "protocol", "estimator/geometry"],
    "daemon/hub": ["daemon/host", "daemon/store", "protocol", "estimator/geometry"],
    "daemon/estimate": ["daemon/host", "daemon/store", "protocol", "estimator"],
    "daemon/run": ["daemon/host", "daemon/ins", "daemon/store", "daemon/estimate", "protocol", "estimator"],
    "daemon": ["daemon", "protocol", "estimator"],
    "tools": ["daemon", "protocol", "estimator", "sim_ins"],
    "tests": ["tools", "daemon", "protocol", "estimator", "sim_ins"],
}

# The estimator is a function of its arguments: no input or output, clock, thread or log.
IMPURE = re.compile(
    r"^(iostream|fstream|ostream|istream|stdio\.h|print|filesystem|chrono|ctime|time\.h|thread|mutex|"
    r"shared_mutex|condition_variable|future|semaphore|latch|barrier|syncstream|unistd\.h|syslog\.h|sys/.*|systemd/.*|"
    r"hdf5.*|sqlite3\.h|sdbus-c\+\+/.*|lcm/.*|toml\+\+/.*|CLI/.*|linux/.*|net/.*)$")
# <cstdio> has snprintf, which is a function of its arguments, and these, which are not.
OUTPUT = re.compile(r"\b(printf|fprintf|puts|putchar|fopen|fwrite|fread|fmt::print|std::cout|std::cerr)\b")
# An effect is known by its address; its id is for files and people. Two variants of one effect share an id.
DIAGNOSING = ("estimator/diagnosis/", "estimator/discovery/")
ID_COMPARED = re.compile(
    r'\bid\b\s*[!=]=|[!=]=\s*[\w.()>\[\]-]*\bid\b|\bid\.(starts|ends)_with\b|\beffect\s*[!=]=\s*"')
# Codecs are bytes in, bytes out: the standard library, tl::expected for errors, fmt for their words, and AES-CMAC.
CODECS = ("protocol/isotp", "protocol/uds", "protocol/flash", "protocol/ins_interface")
CODEC_THIRD_PARTY = re.compile(r"^(tl/expected\.hpp|fmt/.*|openssl/.*)$")
STANDARD = re.compile(r"^[a-z_0-9]+$")

# toml++ does not survive every text; what stands before it does.
TOML = re.compile(r"^toml\+\+/.*$")
TOML_GUARD = "protocol/toml_file/"

# Our own INS is known by its profile alone. A number below this is too common to be one of an INS: a hexadecimal 0x10 is none.
OWN_PROFILE = "config/profiles/selfcal.toml"
LEAST_OWN = 0x100
TOML_NUMBER = re.compile(r"^\s*(?:did|routine|serial|software|in_force|inactive|factory|request|response|functional|status)"
                         r"\s*=\s*(0x[0-9A-Fa-f]+)")
HEX_NUMBER = re.compile(r"\b0[xX][0-9A-Fa-f']+")

# As clang-format writes them: what begins a line is in no function and in no type.
NAMESPACE = re.compile(r"^namespace(?:\s+([\w:]+))?\s*\{")
NAMESPACE_END = re.compile(r"^\}\s*// namespace")
TYPE = re.compile(r"^(?:template <.*>\s*)?(?:struct|class|enum(?: class)?)\s+(\w+)(?!\s*::)\b[^;]*\{")

# Paths generated at build time; written <like/this>, so never mistaken for files of ours.
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
TOP_LEVEL = ["estimator", "protocol", "sim_ins", "daemon", "tools", "tests", "config", "systemd"]
CODE = {".hpp", ".cpp", ".h", ".cc"}
TEXT = CODE | {".py", ".sh", ".cmake", ""}
LINE_LIMIT = 500


def module_of(path):
    prefixes = [m for m in MAY_INCLUDE if path == m or path.startswith(m + "/")]
    return max(prefixes, key=len, default=None)


def allowed(source, target):
    """Whether `source` may include `target`, both paths from the repository root."""
    own = module_of(source)
    if own is None or module_of(target) == own:
        return True
    return any(target == p or target.startswith(p + "/") for p in MAY_INCLUDE[own])


def is_codec(path):
    return module_of(path) in CODECS


def include_complaints(root, path):
    source = path.relative_to(root).as_posix()
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        where = f"{source}:{number}"
        match = INCLUDE.match(line)
        if not match:
            if source.startswith("estimator/") and OUTPUT.search(line.partition("//")[0]):
                yield f"{where}: the estimator prints nothing and opens no file"
            if source.startswith(DIAGNOSING) and ID_COMPARED.search(line.partition("//")[0]):
                yield f"{where}: an effect is known by its address, not by its id"
            continue
        quoted, name = match[1] == '"', match[2]
        if quoted:
            if not (root / name).is_file():
                yield f'{where}: "{name}" is no path from the repository root'
            elif not allowed(source, name):
                yield f'{where}: {module_of(source)} must not include "{name}"'
        elif source.startswith("estimator/") and IMPURE.match(name):
            yield f"{where}: the estimator does no input, output, timing or threading, so no <{name}>"
        elif TOML.match(name) and not source.startswith(TOML_GUARD):
            yield f"{where}: only {TOML_GUARD} includes <{name}>"
        elif is_codec(source) and not STANDARD.match(name) and not CODEC_THIRD_PARTY.match(name):
            yield f"{where}: a codec depends on the standard library only, not on <{name}>"


def own_numbers(root):
    """What our own INS's profile says as a number: identifiers of frames and data, and routines."""
    profile = root / OWN_PROFILE
    lines = profile.read_text(encoding="utf-8").splitlines() if profile.is_file() else []
    found = (TOML_NUMBER.match(line) for line in lines)
    numbers = {int(match[1], 16) for match in found if match}
    return {number for number in numbers if number >= LEAST_OWN}


def number_complaints(root, path, own):
    source = path.relative_to(root).as_posix()
    if source.startswith("tests/"):
        return
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        for match in HEX_NUMBER.finditer(line):
            if int(match[0].replace("'", ""), 16) in own:
                yield f"{source}:{number}: {match[0]} is our own INS's: it stands in {OWN_PROFILE} alone"


def types_of(path):
    """(line number, qualified name) of each type that other files may know."""
    within = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        if match := NAMESPACE.match(line):
            within.append(match[1])
        elif NAMESPACE_END.match(line) and within:
            within.pop()
        elif (match := TYPE.match(line)) and None not in within:
            yield number, "::".join([*within, match[1]])


def type_complaints(root, path, known):
    source = path.relative_to(root).as_posix()
    if source.startswith("tests/"):
        return
    for number, name in types_of(path):
        if name in known:
            yield f"{source}:{number}: {name} is another type in {known[name]}"
        known.setdefault(name, source)


def complaints(root):
    own = own_numbers(root)
    types = {}
    for folder in TOP_LEVEL:
        if not (root / folder / "README.md").is_file():
            yield f"{folder}/: has no README.md"
        for path in sorted((root / folder).rglob("*")):
            if not path.is_file() or path.suffix not in TEXT or "__pycache__" in path.parts:
                continue
            length = path.read_bytes().count(b"\n")
            if length > LINE_LIMIT:
                yield f"{path.relative_to(root)}: {length} lines, more than {LINE_LIMIT}"
            if path.suffix in CODE:
                yield from include_complaints(root, path)
                yield from number_complaints(root, path, own)
                yield from type_complaints(root, path, types)


def main():
    found = list(complaints(Path(sys.argv[1]).resolve()))
    print("\n".join(found) if found else "module boundaries: kept")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
