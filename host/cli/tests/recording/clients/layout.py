"""Holds a Foxglove layout to the settings that Foxglove's SDK knows, and its message paths to the
schemas of a recording. Prints how many of each there are, as JSON.

    layout.py LAYOUT.json FILE.mcap
"""

import dataclasses
import json
import re
import sys
import types
import typing

import foxglove.layouts
from mcap.reader import make_reader
from ros_parser import parse_schema_to_definitions
from ros_parser.message_path import parse_message_path

CONFIGS = {
    "Plot": foxglove.layouts.PlotConfig,
    "StateTransitions": foxglove.layouts.StateTransitionsConfig,
    "3D": foxglove.layouts.ThreeDeeConfig,
}


def members(kind):
    """The types that a union may be, or the type alone."""
    union = typing.get_origin(kind) in (typing.Union, types.UnionType)
    return typing.get_args(kind) if union else (kind,)


def fits(value, kind, place):
    """Why a value is none of this type, or nothing."""
    wrong = [why for member in members(kind) if (why := misfit(value, member, place))]
    return None if len(wrong) < len(members(kind)) else wrong[0]


def misfit(value, kind, place):
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind) and isinstance(value, dict):
        hints = typing.get_type_hints(kind, vars(foxglove.layouts))
        for key, inner in value.items():
            name = re.sub("[A-Z]", lambda letter: "_" + letter.group().lower(), key)
            if name not in hints:
                return f"{place}: {kind.__name__} has no {key}"
            if why := fits(inner, hints[name], f"{place}.{key}"):
                return why
        return None
    if origin is list and isinstance(value, list):
        return next((why for v in value if (why := fits(v, arguments[0], place))), None)
    if origin is dict and isinstance(value, dict):
        inner = ((f"{place}.{key}", v) for key, v in value.items())
        return next((why for at, v in inner if (why := fits(v, arguments[1], at))), None)
    if origin is typing.Literal:
        return None if value in arguments else f"{place}: {value!r} is none of {arguments}"
    if kind is float and isinstance(value, int):
        return None
    is_plain = isinstance(kind, type) and isinstance(value, kind)
    return None if kind is typing.Any or is_plain else f"{place}: {value!r} is no {kind}"


def main(layout_path, mcap_path):
    with open(layout_path) as file:
        panels = json.load(file)["configById"]
    with open(mcap_path, "rb") as file:
        summary = make_reader(file).get_summary()
    schemas = {c.topic: summary.schemas[c.schema_id] for c in summary.channels.values()}
    paths = 0
    for name, config in panels.items():
        settings = {key: v for key, v in config.items() if key != "foxglovePanelTitle"}
        if why := fits(settings, CONFIGS[name.split("!")[0]], name):
            sys.exit(why)
        for path in config.get("paths", []):
            parsed = parse_message_path(path["value"])
            schema = schemas[parsed.topic]
            all_of_it = parse_schema_to_definitions(schema.name, schema.data)
            parsed.validate(all_of_it[schema.name], all_of_it)
            paths += 1
        for topic in config.get("topics", {}):
            if topic not in schemas:
                sys.exit(f"{name}: no topic {topic}")
    json.dump({"panels": len(panels), "paths": paths}, sys.stdout)


main(*sys.argv[1:])
