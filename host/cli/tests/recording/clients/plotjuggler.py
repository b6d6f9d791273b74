"""Holds a PlotJuggler layout to what PlotJuggler's loader takes, and its curves to the series that
its ROS parser makes of a recording. Prints how many plots and curves there are, as JSON.

The program itself cannot be installed from a package index. Its loader's sources (plot_docker.cpp,
plotwidget.cpp, ros_parser.cpp of PlotJuggler 3) say what is checked here: it takes as many sizes as
a splitter counts and reads beyond a shorter list, passes over elements that it does not know, and
shows a message box for a curve that no series has.

    plotjuggler.py LAYOUT.xml FILE.mcap
"""

import json
import re
import sys
import xml.etree.ElementTree

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

CHILDREN = {
    "root": {"tabbed_widget", "use_relative_time_offset"},
    "tabbed_widget": {"Tab", "currentTabIndex"},
    "Tab": {"Container"},
    "Container": {"DockSplitter"},
    "DockSplitter": {"DockSplitter", "DockArea"},
    "DockArea": {"plot"},
    "plot": {"limitY", "range", "curve"},
}
WORDS = {
    ("DockSplitter", "orientation"): "[|-]",
    ("plot", "mode"): "TimeSeries",
    ("plot", "style"): "Lines|LinesAndDots|Dots|Sticks|Steps|StepsInv",
    ("plot", "flip_x"): "true|false",
    ("plot", "flip_y"): "true|false",
    ("curve", "color"): "#[0-9a-f]{6}",
    ("use_relative_time_offset", "enabled"): "[01]",
}


def check(element):
    allowed = CHILDREN.get(element.tag, set())
    for child in element:
        if child.tag not in allowed:
            sys.exit(f"<{child.tag}> in <{element.tag}>")
        check(child)
    for (tag, name), words in WORDS.items():
        if tag == element.tag and not re.fullmatch(words, element.get(name, "")):
            sys.exit(f"<{tag} {name}={element.get(name)!r}>")
    if element.tag == "DockSplitter":
        sizes = [float(size) for size in element.get("sizes").split(";")]
        count = int(element.get("count"))
        if not len(sizes) == len(element) == count or abs(sum(sizes) - 1) > 0.01:
            sys.exit(f"a splitter of {count} has {len(element)} parts of {sizes}")


def series(prefix, value):
    """Names of the numbers in a message, as PlotJuggler names them."""
    if type(value).__name__ == "JointState":
        for part in ("position", "velocity", "effort"):
            yield from (f"{prefix}/{n}/{part}" for n, _ in zip(value.name, getattr(value, part)))
    elif isinstance(value, (bool, int, float)):
        yield prefix
    elif hasattr(value, "__slots__"):
        for name in value.__slots__:
            yield from series(f"{prefix}/{name}", getattr(value, name))


def main(layout_path, mcap_path):
    root = xml.etree.ElementTree.parse(layout_path).getroot()
    check(root)
    tabs = len(root.findall("tabbed_widget/Tab"))
    if not int(root.find("tabbed_widget/currentTabIndex").get("index")) < tabs:
        sys.exit("no such tab")
    with open(mcap_path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        # PlotJuggler's loader wants it too, and does not go through a file that has none.
        end_ns = reader.get_summary().statistics.message_end_time
        # Every series that goes on has something in the last second.
        messages = reader.iter_decoded_messages(starting_at=end_ns - 10**9)
        recorded = {name for _, c, _, decoded in messages for name in series(c.topic, decoded)}
    curves = [curve.get("name") for curve in root.iter("curve")]
    if missing := [name for name in curves if name not in recorded]:
        sys.exit(f"no series {missing}")
    json.dump({"plots": len(root.findall(".//plot")), "curves": len(curves)}, sys.stdout)


main(*sys.argv[1:])
