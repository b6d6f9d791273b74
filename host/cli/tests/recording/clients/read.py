"""Reads with independent tools what cathforce writes, and prints what they found as JSON.

    read.py FILE.mcap FILE.log FILE.parquet
"""

import collections
import io
import json
import sys

import can
import cantools
import pandas
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

TO_DEVICE, TO_HOST = "/cathforce/to_can_bus", "/cathforce/from_can_bus"


def recording(path):
    """Counts, and whether CAN frames decoded by the attached DBC say what the topics say."""
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
        attachments = {a.name: a.data for a in reader.iter_attachments()}
        metadata = {m.name: m.metadata for m in reader.iter_metadata()}
        dbc = cantools.database.load(io.StringIO(attachments["cathforce.dbc"].decode()), "dbc")
        kinds = {m.frame_id: m.name for m in dbc.messages}
        counts, frames = collections.Counter(), collections.Counter()
        contact, force, worst, cloud = {}, {}, 0.0, None
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            if channel.topic in (TO_DEVICE, TO_HOST):
                name = kinds.get(decoded.id, "other")
                frames[name] += 1
                if name == "CONTACT":
                    contact[message.publish_time] = dbc.decode_message(
                        decoded.id, bytes(decoded.data)[: decoded.dlc]
                    )
            elif channel.topic == "/catheter/estimated/spatial/measured_cf":
                force[message.publish_time] = decoded.wrench.force
            elif channel.topic == "/catheter/estimated/shape":
                cloud = decoded
        for time, wrench in force.items():
            by_dbc = [contact[time][axis] for axis in "XYZ"]
            pairs = zip(by_dbc, (wrench.x, wrench.y, wrench.z))
            worst = max(worst, *(abs(a - b) for a, b in pairs))
        return {
            "profile": reader.get_header().profile,
            "topics": counts,
            "frames": frames,
            "attachments": {name: len(data) for name, data in attachments.items()},
            "firmware_sha256": metadata["cathforce"]["firmware_sha256"],
            "forces_compared": len(force),
            "worst_force_difference_n": worst,
            "cloud": [[f.name for f in cloud.fields], cloud.width, len(cloud.data)],
        }


def log(path):
    """Frames and the seconds from the first to the last."""
    frames = list(can.LogReader(path))
    return {"frames": len(frames), "seconds": frames[-1].timestamp - frames[0].timestamp}


def table(path):
    """Rows, and some columns."""
    ticks = pandas.read_parquet(path)
    return {
        "rows": len(ticks),
        "columns": list(ticks.columns),
        "last_tick": int(ticks["tick"].iloc[-1]),
        "modes": sorted(set(ticks["mode"])),
        "forces": int(ticks["fx_N"].notna().sum()),
        "peak_n": float((ticks[["fx_N", "fy_N", "fz_N"]] ** 2).sum(axis=1).max() ** 0.5),
    }


mcap_path, log_path, parquet_path = sys.argv[1:]
json.dump(
    {"recording": recording(mcap_path), "log": log(log_path), "table": table(parquet_path)},
    sys.stdout,
)
