"""Reads docs/cathforce.dbc with cantools and compares it with frames of the encoders.

stdin: one JSON object a line, {"id", "data" (hex), "signals": {name: value}}.
Prints "N frames" at the end; a difference ends it with what differs.
"""

import json
import sys

import cantools

database = cantools.database.load_file(sys.argv[1], strict=True)
for message in database.messages:
    assert not message.is_extended_frame, f"{message.name}: 29-bit identifier"
    assert not message.is_multiplexed(), f"{message.name}: multiplexed"
    assert message.length == 8, f"{message.name}: {message.length} bytes"

frames = 0
seen = set()
for line in sys.stdin:
    frame = json.loads(line)
    message = database.get_message_by_frame_id(frame["id"])
    data = bytes.fromhex(frame["data"])
    read = message.decode(data, decode_choices=False)
    meant = frame["signals"]
    assert read.keys() == meant.keys(), f"{message.name}: {read.keys()} {meant.keys()}"
    for name, value in meant.items():
        # A quantity went through single precision.
        assert abs(read[name] - value) <= 1.2e-7 * abs(value), f"{message.name}.{name}: {read[name]} {value}"
    assert message.encode(read) == data, f"{message.name}: {message.encode(read).hex()} {data.hex()}"
    seen.add(message.frame_id)
    frames += 1
missing = {message.name for message in database.messages if message.frame_id not in seen}
assert not missing, f"never seen: {missing}"
print(f"{frames} frames")
