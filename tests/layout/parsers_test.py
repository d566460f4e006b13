#!/usr/bin/env python3
"""parsers_test.py: whoever takes bytes of others is fuzzed, or says why not.

A source that reads files, sockets, pictures or texts with one of the calls below is among the SOURCES of a fuzzer
(tests/fuzz/CMakeLists.txt), or has a line `// Not fuzzed: REASON`, with the fuzzer of the parser that it hands the bytes to,
where there is one. A new parser without a fuzzer fails this test; so does a reason that names a fuzzer that is not there.
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
CALLS = {
    'YAML::Load': 'parses YAML',
    'parse_json(': 'parses JSON',
    'YamlReader::from_': 'reads a YAML file',
    'read_text(': 'reads a file',
    'text_of_file(': 'reads a file',
    'ifstream': 'reads a file',
    '::recv(': 'reads a socket',
    '::recvfrom(': 'reads a socket',
    '::recvmsg(': 'reads a socket',
    'jpeg_read_header(': 'decodes JPEG',
    'tjDecompress': 'decodes JPEG',
    'spng_': 'decodes PNG',
    'imdecode(': 'decodes pictures',
    'imread(': 'decodes pictures',
    'sqlite3_column_': 'reads a database',
    'libusb_get_': 'reads USB descriptors',
    'sd_bus_message_read': 'reads D-Bus',
    'pb_decode(': 'decodes protobuf',
    'http::async_read(': 'reads HTTP',
    'async_read_some(': 'reads a stream',
}
REASON = re.compile(r'// Not fuzzed: (\S.*)')
FUZZED_BY = re.compile(r'\bfuzz\.(\w+)')


def fuzzers():
    """Their names, and the sources that they see, relative to the tree's top."""
    text = (ROOT / 'tests/fuzz/CMakeLists.txt').read_text()
    names = set(re.findall(r'tagwrench_fuzzer\(NAME (\w+)', text))
    folders = dict(re.findall(r'set\((\w+) \$\{PROJECT_SOURCE_DIR\}/([\w/]+)\)', text))
    sources = set()
    for variable, rest in re.findall(r'\$\{(\w+)\}/([\w/]+\.(?:cpp|c))', text):
        folder = '' if variable == 'PROJECT_SOURCE_DIR' else folders.get(variable)
        if folder is not None:
            sources.add(f'{folder}/{rest}'.lstrip('/'))
    for variable, pattern in re.findall(r'file\(GLOB \w+ \$\{(\w+)\}/(\S+)\)', text):
        sources.update(str(p.relative_to(ROOT)) for p in (ROOT / folders[variable]).glob(pattern))
    if 'TAGWRENCH_PROTOCOL_SOURCES' in text:
        sources.update(str(p.relative_to(ROOT)) for p in (ROOT / 'protocol').glob('*.cpp'))
    return names, sources


def faults(files, names, sources):
    """A line for each source that is not fuzzed and does not say why."""
    for file, text in files:
        used = sorted({what for call, what in CALLS.items() if call in text})
        reasons = REASON.findall(text)
        unknown = [name for reason in reasons for name in FUZZED_BY.findall(reason) if name not in names]
        if unknown:
            yield f'{file}: says that it is fuzzed by fuzz.{unknown[0]}, and there is no such fuzzer'
        elif reasons and not used:
            yield f'{file}: says why it is not fuzzed, and reads nothing; take the line out'
        elif used and not reasons and file not in sources:
            yield (f'{file}: {", ".join(used)}: bytes of others. Add it to a fuzzer in tests/fuzz/CMakeLists.txt, '
                   'or say `// Not fuzzed: REASON`')


def our_files():
    for folder in ('host', 'protocol', 'firmware'):
        for file in sorted((ROOT / folder).rglob('*')):
            if file.suffix in ('.cpp', '.c') and 'node_modules' not in file.parts and 'generated' not in file.parts:
                yield str(file.relative_to(ROOT)), file.read_text()


def main():
    names, sources = fuzzers()
    # The test itself: a parser that nobody fuzzes is found.
    new = [('host/new.cpp', 'const YAML::Node n = YAML::Load(text);')]
    told = [('host/new.cpp', '// Not fuzzed: fuzz.yaml_files has its parser.\nread_text(file);')]
    wrong = [('host/new.cpp', '// Not fuzzed: fuzz.nobody has its parser.\nread_text(file);')]
    assert list(faults(new, names, sources)) and list(faults(wrong, names, sources))
    assert not list(faults(told, names, sources)), list(faults(told, names, sources))
    assert 'host/core/yaml/yaml_reader.cpp' in sources and 'host/source/decode.cpp' in sources, sources

    found = list(faults(our_files(), names, sources))
    print('\n'.join(found) or f'{len(sources)} sources are seen by {len(names)} fuzzers; all others say why not')
    return 1 if found else 0


if __name__ == '__main__':
    sys.exit(main())
