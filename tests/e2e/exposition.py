"""A strict reader of the Prometheus text format, after its specification and the rules of `promtool check metrics`."""
import math
import re

NAME = r"[a-zA-Z_:][a-zA-Z0-9_:]*"
SAMPLE = re.compile(r"(%s)(?:\{(.*)\})? (\S+)$" % NAME)
LABEL = re.compile(r"([a-zA-Z_][a-zA-Z0-9_]*)=\"((?:[^\"\\\n]|\\[\\n\"])*)\"(?:,|$)")
UNITS = {"milliseconds", "microseconds", "nanoseconds", "minutes", "hours", "days", "kilobytes", "megabytes", "bits", "percent"}


class Family:
    def __init__(self, name, text):
        self.name, self.help, self.type, self.samples = name, text, None, []


def _labels(text, line):
    labels, at = {}, 0
    while text and at < len(text):
        match = LABEL.match(text, at)
        assert match, "labels: " + line
        assert match.group(1) not in labels, "a label twice: " + line
        labels[match.group(1)] = match.group(2)
        at = match.end()
    return labels


def _value(text, line):
    assert re.fullmatch(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?Inf|NaN", text), "value: " + line
    return float(text)


def parse(text, prefix="gnpd_"):
    """name -> Family. Every fault is an AssertionError that quotes the line."""
    families, family, seen = {}, None, set()
    assert text.endswith("\n") and "\r" not in text, "lines end in a newline"
    for line in text[:-1].split("\n"):
        if line.startswith("# HELP "):
            _, _, name, about = line.split(" ", 3)
            assert name not in families, "a family twice: " + line
            assert name.startswith(prefix) and re.fullmatch(NAME, name) and about.strip(), line
            family = families[name] = Family(name, about)
        elif line.startswith("# TYPE "):
            _, _, name, kind = line.split(" ")
            assert family and family.name == name and family.type is None and not family.samples, "TYPE follows its HELP: " + line
            assert kind in ("counter", "gauge", "histogram"), line
            family.type = kind
        else:
            match = SAMPLE.match(line)
            assert match, "neither sample nor comment: " + line
            name, labels, value = match.group(1), _labels(match.group(2), line), _value(match.group(3), line)
            suffixes = ("_bucket", "_sum", "_count") if family and family.type == "histogram" else ("",)
            assert family and family.type and name in [family.name + suffix for suffix in suffixes], "of another family: " + line
            series = (name, tuple(sorted(labels.items())))
            assert series not in seen, "a series twice: " + line
            seen.add(series)
            family.samples.append((name, labels, value))
    for family in families.values():
        _check(family)
    return families


def _check(family):
    name = family.name
    assert family.samples, "no samples: " + name
    assert (family.type == "counter") == name.endswith("_total"), "counters, and they alone, end in _total: " + name
    assert not name.endswith(("_count", "_sum", "_bucket", "_info")) or name.endswith("_build_info"), "a reserved suffix: " + name
    assert not UNITS & set(name.split("_")), "not a base unit: " + name
    assert len({frozenset(labels) - {"le"} for _, labels, _ in family.samples}) == 1, "label names differ: " + name
    if family.type == "counter":
        assert all(value >= 0 for _, _, value in family.samples), "a negative counter: " + name
    if family.type == "histogram":
        _check_histogram(family)


def _check_histogram(family):
    groups = {}
    for name, labels, value in family.samples:
        key = tuple(sorted((k, v) for k, v in labels.items() if k != "le"))
        groups.setdefault(key, []).append((name[len(family.name):], labels.get("le"), value))
    for key, rows in groups.items():
        buckets = [(float(le), value) for suffix, le, value in rows if suffix == "_bucket"]
        assert buckets == sorted(buckets) and math.isinf(buckets[-1][0]), "buckets rise to +Inf: %s %s" % (family.name, key)
        assert all(a[1] <= b[1] for a, b in zip(buckets, buckets[1:])), "buckets are cumulative: %s %s" % (family.name, key)
        counts = [value for suffix, _, value in rows if suffix == "_count"]
        assert counts == [buckets[-1][1]] and len([1 for suffix, _, _ in rows if suffix == "_sum"]) == 1, (family.name, key)
