"""Files of others, read without running anything in them, with a sentence for whatever is not as expected."""

import json
import math
import re
from pathlib import Path
from xml.etree import ElementTree

from gatefield.errors import Invalid, Unreadable, Unsupported

LARGEST_BYTES = 16 << 20
LARGEST_NUMBER = 1e12  # beyond anything of a course or vehicle, and far from where arithmetic overflows
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


class Node:
    """A value of a file and where it was found, so that a mistake is said with file, field, value and expectation."""

    def __init__(self, file, value, path=""):
        self.file = file
        self.value = value
        self.path = path

    def refuse(self, expected):
        """Raises Invalid: "FILE: FIELD is VALUE, expected ..."."""
        shown = repr(self.value)
        shown = shown if len(shown) <= 60 else shown[:57] + "..."
        raise Invalid(f"{self.file}: {self.path or 'its content'} is {shown}, expected {expected}", "invalid",
                      self.path, shown, expected, str(self.file))

    def lacks(self, what, cure=""):
        """Raises Invalid for something that is not there."""
        where = f"{self.path} " if self.path else ""
        raise Invalid(f"{self.file}: {where}has no {what}{', ' + cure if cure else ''}", "invalid", self.path, "",
                      cure, str(self.file))

    def find(self, *keys):
        """The node below the first of these keys that is there, or None."""
        if isinstance(self.value, dict):
            for key in keys:
                if key in self.value:
                    return Node(self.file, self.value[key], f"{self.path}.{key}" if self.path else str(key))
        return None

    def need(self, *keys):
        """As find(), refused where there is none."""
        found = self.find(*keys)
        if found is None:
            if not isinstance(self.value, dict):
                self.refuse("a table with " + " or ".join(keys))
            self.lacks(" or ".join(f"'{key}'" for key in keys), f"expected it there: the file has {self._keys()}")
        return found

    def _keys(self):
        return ", ".join(str(key) for key in list(self.value)[:12]) or "nothing"

    def number(self, low=-math.inf, high=math.inf, what="a number"):
        """A finite number of low to high. PyYAML leaves numbers like 1e-3 as text, so text that is a number is one."""
        value = self.value
        if isinstance(value, str) and _NUMBER.fullmatch(value.strip()):
            value = float(value)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= LARGEST_NUMBER or \
                not low <= value <= high:
            self.refuse(what)
        return float(value)

    def positive(self, what="a number above 0"):
        value = self.number(what=what)
        if value <= 0:
            self.refuse(what)
        return value

    def whole(self, low, high, what="a whole number"):
        value = self.number(low, high, f"{what}, {low} to {high}")
        if value != int(value):
            self.refuse(f"{what}, {low} to {high}")
        return int(value)

    def nodes(self, what="a list"):
        if not isinstance(self.value, (list, tuple)):
            self.refuse(what)
        return [Node(self.file, value, f"{self.path}[{i}]") for i, value in enumerate(self.value)]

    def vector(self, count, what=None):
        """A list of `count` finite numbers as a tuple."""
        expected = what or f"{count} numbers"
        nodes = self.nodes(expected)
        if len(nodes) != count:
            self.refuse(expected)
        return tuple(node.number(what="a finite number") for node in nodes)


def content(path):
    """The file's text."""
    try:
        if Path(path).stat().st_size > LARGEST_BYTES:
            raise Unreadable(f"{path} is larger than {LARGEST_BYTES >> 20} MiB, expected a text of some kilobytes",
                             "unreadable", file=str(path))
        return Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise Unreadable(f"{path} can't be read: {error.strerror}", "unreadable", file=str(path)) from None
    except UnicodeDecodeError:
        raise Unreadable(f"{path} is no text in UTF-8", "unreadable", file=str(path)) from None


def _malformed(path, kind, error):
    return Unreadable(f"{path} is no {kind}: {error}", "unreadable", file=str(path))


def read_json(path):
    try:
        return Node(path, json.loads(content(path)))
    except (ValueError, RecursionError) as error:
        raise _malformed(path, "JSON", error) from None


def read_toml(path):
    try:
        import tomllib as toml
    except ImportError:
        try:
            import tomli as toml
        except ImportError:
            raise Unsupported(f"{path} is TOML, which Python reads from 3.11 on; for an older one install tomli "
                              "(apt install python3-tomli, or pip install tomli)", "unsupported") from None
    try:
        return Node(path, toml.loads(content(path)))
    except (toml.TOMLDecodeError, RecursionError) as error:
        raise _malformed(path, "TOML", error) from None


def read_yaml(path):
    """YAML, OpenCV's dialect of it included: its first line and the names of its matrices are no YAML 1.1."""
    try:
        import yaml
    except ImportError:
        raise Unsupported(f"{path} is YAML, which needs PyYAML (apt install python3-yaml, or pip install pyyaml)",
                          "unsupported") from None

    class Loader(yaml.SafeLoader):
        pass

    def matrix(loader, _kind, node):
        return loader.construct_mapping(node, True)

    Loader.add_multi_constructor("tag:yaml.org,2002:opencv-", matrix)
    text = re.sub(r"\A%YAML:1\.\d[^\n]*\n", "", content(path))
    try:
        return Node(path, yaml.load(text, Loader))
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        raise _malformed(path, "YAML", " ".join(str(error).split())) from None


def read_xml(path):
    """The root element. Files that define entities are refused: nothing of ours needs them, and they can grow."""
    text = content(path)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise Invalid(f"{path} has a document type, expected plain XML without <!DOCTYPE or <!ENTITY", "invalid",
                      file=str(path))
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise _malformed(path, "XML", error) from None


def attribute(file, element, name, default=None, where=None):
    """An XML attribute as a Node: a number, a list of numbers, or text. None: it is not there and has no default."""
    text = element.get(name, default)
    if text is None:
        return None
    words = str(text).split()
    numbers = [float(word) for word in words if _NUMBER.fullmatch(word)]
    value = text
    if words and len(numbers) == len(words):
        value = numbers if len(numbers) > 1 else numbers[0]
    return Node(file, value, f"{where or label(element)}.{name}")


def label(element):
    """How an element is called in a sentence."""
    name = element.get("name")
    return f"{element.tag} '{name}'" if name else element.tag
