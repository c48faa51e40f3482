"""Structure-aware mutants of the files that regrasp reads. Every function takes a random.Random, so that a seed is a mutant."""

import copy
import json
import re
import struct
import xml.etree.ElementTree as ElementTree

# Nothing larger is made: how reading grows with its input is another test.
MOST_BYTES = 1 << 20

NUMBERS = [
    "0", "-0.0", "1", "-1", "0.5", "2", "3", "255", "1e-12", "1e-9", "-1e-9", "1e-6", "1e-5", "1e-3", "100", "1e3", "1e4", "-1e4", "1e6",
    "1e9", "1e10", "1e15", "1e18", "1e100", "1e154", "1e200", "-1e200", "1e300", "1e308", "-1e308", "1.7976931348623157e308", "1e309",
    "1e-300", "1e-308", "5e-324", "1e-320", "-5e-324", "2147483647", "2147483648", "4294967295", "4294967296",
    "9007199254740993", "9223372036854775807", "-9223372036854775808", "18446744073709551615", "18446744073709551616",
    "3.141592653589793", "6.283185307179586", "0.1", "0.49999999999999994", "1" + "0" * 400, "0." + "0" * 400 + "1",
]
NOT_NUMBERS = ["nan", "inf", "-inf", "NaN", "Infinity", "", "0x10", "1_000", "1,5", "true", "null", "--1", "1e", "\u0661"]
NAMES = [
    "", " ", "x", "..", ".", "/", "//", "../../../../etc/passwd", "/etc/passwd", "/dev/zero", "/dev/stdin", "/proc/self/mem", "scene.toml",
    "a" * 1000, "b" * 50_000, "a/" * 2000, "check  ACCEPTED", "x\ncheck  ACCEPTED   78 waypoints", "x\r\u001b[2Jcheck  ACCEPTED",
    "\u202egnp.exe", "\u200b", "\ufeff", "\u0000", "\u007f", "\u0085", "\U0001f980" * 100, "e\u0301", "%s%n%x", "{0}", "</script><script>",
    "<!--", "'\"\\", "package://", "package://models", "package://a/../../b", "file:///etc/passwd", "http://x/y", "nan", "0", "-1", "world",
]

NUMBER = re.compile(r"(?<![A-Za-z_\"'\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
QUOTED = re.compile(r"\"[^\"\n]{0,200}\"")


def number(rng, old=None):
    """A number as text: an extreme, something that is none, or one near the old one."""
    draw = rng.random()
    if old is not None and draw < 0.35:
        try:
            value = float(old)
        except ValueError:
            return rng.choice(NUMBERS)
        factor = rng.choice([-1.0, 0.0, 0.5, 0.999, 1.000001, 1.1, 2.0, 10.0, 100.0, 1e3, 1e6, 1e-3, 1e-6])
        return repr(value * factor)
    return rng.choice(NUMBERS if draw < 0.93 else NOT_NUMBERS)


def cut(rng, text):
    """A beginning, an end, or all but a piece of the middle."""
    a, b = sorted(rng.randrange(len(text) + 1) for _ in range(2))
    return rng.choice([text[:a], text[a:], text[:a] + text[b:]])


def repeated(rng, text):
    """A piece of it over and over."""
    a, b = sorted(rng.randrange(len(text) + 1) for _ in range(2))
    b = min(b, a + rng.choice([1, 10, 100, 1000]))
    n = rng.choice([2, 3, 10, 100, 1000, 10_000])
    n = min(n, max(1, (MOST_BYTES - len(text)) // max(1, b - a)))
    return text[:a] + text[a:b] * n + text[b:]


def replace_match(rng, text, pattern, new):
    """One match of the pattern, replaced by what `new` makes of it."""
    found = list(pattern.finditer(text))
    if not found:
        return text
    one = rng.choice(found)
    return text[: one.start()] + new(one.group()) + text[one.end() :]


def line_mutant(rng, text, quote):
    """A mutant of a text of lines: numbers, names, lines removed, doubled, swapped, moved, glued, cut, repeated."""
    lines = text.split("\n")
    i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    draw = rng.random()
    if draw < 0.40:
        return replace_match(rng, text, NUMBER, lambda old: number(rng, old))
    if draw < 0.55:
        others = QUOTED.findall(text) or ['""']
        new = rng.choice(others) if rng.random() < 0.4 else quote(rng.choice(NAMES))
        return replace_match(rng, text, QUOTED, lambda _: new)
    if draw < 0.63:
        del lines[i]
    elif draw < 0.70:
        lines.insert(j, lines[i])
    elif draw < 0.77:
        lines[i], lines[j] = lines[j], lines[i]
    elif draw < 0.82:
        lines[i : i + 1] = [lines[i]] * min(rng.choice([2, 10, 100, 1000, 5000]), 1 + MOST_BYTES // (len(lines[i]) + 1))
    elif draw < 0.86:
        lines[i] = rng.choice([lines[i] * 3, lines[i].strip(), lines[i] + " " + lines[j], lines[i][::-1], lines[i].upper()])
    elif draw < 0.90:
        return cut(rng, text)
    elif draw < 0.94:
        return repeated(rng, text)
    elif draw < 0.97:
        return rng.choice(["\r\n", "\r", "\n\n", " "]).join(lines)
    else:
        old = rng.choice([" ", "=", "\"", "[", "]", "<", ">", "0", "."])
        return text.replace(old, rng.choice(["", "  ", "\t", "=", "\"", "\0", "\ufeff"]))
    return "\n".join(lines)


def toml_quote(name):
    """A name as a basic string of TOML."""
    return json.dumps(name)


def xml_quote(name):
    """A name as an attribute of XML; what XML cannot say stays as it is."""
    escaped = name.replace("&", "&amp;").replace("<", "&lt;").replace('"', "&quot;").replace("\n", "&#10;").replace("\r", "&#13;")
    return f'"{escaped}"'


def toml_mutant(rng, text):
    """A mutant of a TOML file."""
    if rng.random() < 0.06:
        deep = rng.choice([50, 200, 5000, 50_000])
        nest = rng.choice([("[", "]"), ("{a=", "}"), ("[[", "]]")])
        return text + f"\nx = {nest[0] * deep}1{nest[1] * deep}\n"
    if rng.random() < 0.04:
        return text + "".join(f"\nkey_{k} = {rng.choice(NUMBERS)}" for k in range(rng.choice([10, 1000, 20_000])))
    return line_mutant(rng, text, toml_quote)


def xml_mutant(rng, text):
    """A mutant of an XML file: of its tree, or of its text."""
    draw = rng.random()
    if draw < 0.05:
        deep = rng.choice([50, 200, 5000, 100_000])
        opened = rng.choice(["<a>", "<link name='x'>", "<!-- ", "<?x ", "<?x \"?><a>"])
        return text.replace("</robot>", opened * deep + "</robot>", 1)
    if draw < 0.10:
        n = rng.choice([10, 1000, 10_000])
        many = rng.choice(["<collision><geometry><sphere radius=\"0.001\"/></geometry></collision>", "<a xmlns:q='q'/>", "<link name='l'/>"])
        at = rng.choice([match.end() for match in re.finditer(r"<link[^/>]*>", text)] or [0])
        return text[:at] + many * n + text[at:]
    if draw < 0.45:
        return line_mutant(rng, text, xml_quote)
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError:
        return line_mutant(rng, text, xml_quote)
    for _ in range(rng.choice([1, 1, 2, 4])):
        parents = [element for element in root.iter() if len(element)]
        if not parents:
            break
        parent = rng.choice(parents)
        element = parent[rng.randrange(len(parent))]
        other = rng.choice(parents)
        every = list(root.iter())
        draw = rng.random()
        if draw < 0.15:
            parent.remove(element)
        elif draw < 0.30:
            parent.insert(rng.randrange(len(parent) + 1), copy.deepcopy(element))
        elif draw < 0.40:
            other.append(copy.deepcopy(element))
        elif draw < 0.45:
            element[:] = copy.deepcopy(list(other))
        elif draw < 0.50:
            element.tag = rng.choice(every).tag
        else:
            one = rng.choice([element for element in every if element.attrib] or [root])
            if not one.attrib:
                continue
            key = rng.choice(sorted(one.attrib))
            old = one.attrib[key]
            draw = rng.random()
            if NUMBER.search(old) and draw < 0.6:
                one.attrib[key] = replace_match(rng, old, NUMBER, lambda value: number(rng, value))
            elif draw < 0.7:
                del one.attrib[key]
            elif draw < 0.85:
                one.attrib[key] = rng.choice([value for element in every for value in element.attrib.values()])
            else:
                # A tree cannot hold what XML cannot say.
                one.attrib[key] = "".join(c for c in rng.choice(NAMES) if c in "\n\r\t" or c >= " ")
    return ElementTree.tostring(root, encoding="unicode")


def places(value, path=()):
    """Every place in a JSON document."""
    yield path
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in children:
        yield from places(child, (*path, key))


class Raw(float):
    """A number that is written as it stands, however large."""

    def __new__(cls, text):
        made = super().__new__(cls, 0.0)
        made.text = text
        return made

    def __repr__(self):
        return self.text


def json_text(value):
    """JSON with numbers as they stand."""
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, dict):
        return "{" + ",".join(f"{json.dumps(key)}:{json_text(child)}" for key, child in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ",".join(map(json_text, value)) + "]"
    return json.dumps(value)


def json_mutant(rng, text):
    """A mutant of a JSON file."""
    if rng.random() < 0.12:
        return line_mutant(rng, text, json.dumps)
    document = json.loads(text)
    every = list(places(document))[1:]
    for _ in range(rng.choice([1, 1, 1, 2, 5])):
        path = rng.choice(every)
        try:
            holder = document
            for key in path[:-1]:
                holder = holder[key]
            key = path[-1]
            old = holder[key]
        except (KeyError, IndexError, TypeError):
            continue
        # An earlier change may have put a text where a list was.
        if not isinstance(holder, (dict, list)):
            continue
        draw = rng.random()
        if isinstance(old, (int, float)) and not isinstance(old, bool) and draw < 0.8:
            holder[key] = Raw(number(rng, repr(old)))
        elif isinstance(old, str) and draw < 0.7:
            holder[key] = rng.choice(NAMES)
        elif isinstance(old, list) and old and draw < 0.7:
            i, j = rng.randrange(len(old)), rng.randrange(len(old))
            change = rng.randrange(6)
            if change == 0:
                del old[i]
            elif change == 1:
                old.insert(j, copy.deepcopy(old[i]))
            elif change == 2:
                old[i], old[j] = old[j], old[i]
            elif change == 3:
                size = len(json_text(old[i]))
                old[i : i + 1] = [old[i]] * min(rng.choice([2, 10, 100]), 1 + MOST_BYTES // (size + 1))
            elif change == 4:
                old.reverse()
            else:
                old.clear()
        elif draw < 0.80:
            holder[key] = rng.choice([None, True, [], {}, "", Raw("0"), [[]], "x"])
        elif draw < 0.85:
            deep = rng.choice([100, 1000])
            nested = 0
            for _ in range(deep):
                nested = [nested]
            holder[key] = nested
        elif draw < 0.93:
            del holder[key]
        else:
            other = document
            for step in rng.choice(every):
                try:
                    other = other[step]
                except (KeyError, IndexError, TypeError):
                    break
            holder[key] = copy.deepcopy(other)
    # A number of the same kind everywhere: all joints of a plan, all times.
    if rng.random() < 0.1 and isinstance(document, dict):
        name = rng.choice(["time", "joints", "joint_velocities", "joint_torques", "position", "quat_xyzw", "force_in_object", "point_in_object"])
        value = number(rng)
        for path in places(document):
            if name in path[-2:] and path:
                holder = document
                try:
                    for key in path[:-1]:
                        holder = holder[key]
                    if isinstance(holder[path[-1]], float) and rng.random() < 0.7:
                        holder[path[-1]] = Raw(value)
                except (KeyError, IndexError, TypeError):
                    continue
    return json_text(document)


def obj_mutant(rng, text):
    """A mutant of an OBJ file."""
    if rng.random() < 0.2:
        faces = rng.choice(["f 1 2 3", "f -1 -2 -3", "f 1 1 1", "f 0 1 2", "f 1 2 99999999999", "f 1/1/1 2/2/2 3/3/3", "f " + "1 2 3 " * 500])
        return text + "\n" + "\n".join([faces] * rng.choice([1, 100, 10_000]))
    return line_mutant(rng, text, json.dumps)


def stl_mutant(rng, data):
    """A mutant of a binary STL file."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 2, 10, 100])):
        draw = rng.random()
        if draw < 0.15:
            data[80:84] = struct.pack("<I", rng.choice([0, 1, 2**31, 2**32 - 1, len(data) // 50 + 1]))
        elif draw < 0.75 and len(data) > 134:
            facet = 84 + 50 * rng.randrange((len(data) - 84) // 50)
            value = rng.choice([0.0, 1e-40, 1e-20, 1e20, 3e38, -3e38, float("nan"), float("inf"), 1.0, 0.01, -0.01])
            at = facet + 4 * rng.randrange(12)
            data[at : at + 4] = struct.pack("<f", value)
        elif draw < 0.85:
            data = bytearray(cut(rng, bytes(data)))
        elif draw < 0.95 and len(data) > 134:
            facet = 84 + 50 * rng.randrange((len(data) - 84) // 50)
            if len(data) < MOST_BYTES:
                data += data[facet : facet + 50] * rng.choice([1, 100, 5000])
            data[80:84] = struct.pack("<I", (len(data) - 84) // 50)
        else:
            data[:5] = b"solid"
        if len(data) < 134:
            break
    return bytes(data)


def poked(rng, data):
    """Some words of binary numbers overwritten, or a piece of them cut out."""
    data = bytearray(data)
    for _ in range(rng.choice([0, 1, 2, 10])):
        if len(data) < 8:
            break
        at = rng.randrange(len(data) - 4)
        value = rng.choice([0, 1, 3, 255, 2**31, 2**32 - 1, 0x7F800000, 0x7FC00000, 0x3F800000, rng.randrange(2**32)])
        data[at : at + 4] = struct.pack("<I", value)
    return cut(rng, bytes(data)) if rng.random() < 0.2 else bytes(data)


def ply_mutant(rng, data):
    """A mutant of a binary PLY file: of its header, its numbers, or both."""
    head, end, body = data.partition(b"end_header\n")
    if rng.random() < 0.7:
        text = head.decode("ascii")
        draw = rng.random()
        if draw < 0.4:
            text = replace_match(rng, text, NUMBER, lambda old: number(rng, old))
        elif draw < 0.6:
            names = ["char", "uchar", "int", "double", "float", "list uchar int", "ascii", "binary_big_endian", "x", "face"]
            text = replace_match(rng, text, re.compile(r"[a-z_]+"), lambda _: rng.choice(names))
        else:
            text = line_mutant(rng, text, json.dumps)
        head = text.encode("utf-8", "replace")
    return (head + end + poked(rng, body))[:MOST_BYTES]


def glb_mutant(rng, data):
    """A mutant of a binary glTF file, mostly with the lengths of its chunks made good."""
    length = struct.unpack("<I", data[12:16])[0]
    text, numbers = data[20 : 20 + length].decode("utf-8"), data[28 + length :]
    for _ in range(rng.choice([1, 1, 2, 4])):
        try:
            text = json_mutant(rng, text)[:MOST_BYTES]
        except (ValueError, RecursionError):
            break
    chunk = text.encode("utf-8", "replace")
    numbers = poked(rng, numbers)
    made = b"glTF" + struct.pack("<II", 2, 28 + len(chunk) + len(numbers))
    made += struct.pack("<I", len(chunk)) + b"JSON" + chunk + struct.pack("<I", len(numbers)) + b"BIN\0" + numbers
    return poked(rng, made) if rng.random() < 0.1 else made


def checksum(data):
    """That of docs/reference/roadmap-format.md: four lanes of words, mixed."""
    mask = (1 << 64) - 1

    def mix(lane, word):
        mixed = ((lane ^ word) * 0x9E37_79B9_7F4A_7C15) & mask
        return ((mixed << 29) | (mixed >> 35)) & mask

    lanes = [1, 2, 3, 4]
    padded = data + bytes(-len(data) % 8)
    words = struct.unpack(f"<{len(padded) // 8}Q", padded)
    for i, word in enumerate(words):
        lanes[i % 4] = mix(lanes[i % 4], word)
    total = 0
    for word in [*lanes, len(data)]:
        total = mix(total, word)
    return total


def roadmap_mutant(rng, data):
    """A mutant of a roadmap file, mostly with length and checksum made good."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 8])):
        draw = rng.random()
        if len(data) < 112:
            break
        at = rng.randrange(8, len(data) - 8)
        if draw < 0.30:
            at -= at % 8
            data[at : at + 8] = struct.pack("<Q", rng.choice([0, 1, 2, 255, 65535, 2**31, 2**32 - 1, 2**53, 2**63, 2**64 - 1]))
        elif draw < 0.50:
            at -= at % 8
            value = rng.choice([0.0, -0.0, 1e-320, 1e-9, 1.0, -1.0, 1e4, 1e9, 1e308, float("nan"), float("inf")])
            data[at : at + 8] = struct.pack("<d", value)
        elif draw < 0.65:
            at -= at % 4
            data[at : at + 4] = struct.pack("<I", rng.choice([0, 1, 2, 7, 255, 65535, 2**31, 2**32 - 1]))
        elif draw < 0.75:
            # The table of sizes.
            at = 12 + 4 * rng.randrange(23)
            data[at : at + 4] = struct.pack("<I", rng.choice([0, 1, 2, 64, 1000, 2**20, 2**31, 2**32 - 1]))
        elif draw < 0.85:
            data[at] = rng.randrange(256)
        elif draw < 0.92:
            data = bytearray(cut(rng, bytes(data)))
        else:
            text = bytes(data[104:]).split(b"}")[0]
            found = list(NUMBER.finditer(text.decode("latin-1")))
            if found:
                one = rng.choice(found)
                new = number(rng)[: one.end() - one.start()].ljust(one.end() - one.start(), "0")
                data[104 + one.start() : 104 + one.end()] = new.encode("ascii", "replace")
    if rng.random() < 0.9 and len(data) >= 32:
        data[16:24] = struct.pack("<Q", len(data))
        data[24:32] = struct.pack("<Q", checksum(bytes(data[32:])))
    return bytes(data)


def text_mutant(mutant):
    """A mutant of text as one of bytes: several changes, some not of text at all."""

    def made(rng, data):
        text = data.decode("utf-8")
        for _ in range(rng.choice([1, 1, 1, 2, 3])):
            try:
                text = mutant(rng, text)[:MOST_BYTES]
            except (ValueError, RecursionError):
                break
            if not text:
                break
        data = text.encode("utf-8", "replace")
        if data and rng.random() < 0.03:
            at = rng.randrange(len(data))
            data = data[:at] + bytes(rng.randrange(256) for _ in range(rng.choice([1, 2, 100]))) + data[at:]
        return data

    return made


BY_SUFFIX = {
    ".urdf": text_mutant(xml_mutant),
    ".srdf": text_mutant(xml_mutant),
    ".toml": text_mutant(toml_mutant),
    ".json": text_mutant(json_mutant),
    ".obj": text_mutant(obj_mutant),
    ".stl": stl_mutant,
    ".ply": ply_mutant,
    ".dae": text_mutant(xml_mutant),
    ".glb": glb_mutant,
    ".roadmap": roadmap_mutant,
}
