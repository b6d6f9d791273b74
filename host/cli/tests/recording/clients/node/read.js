// Reads every message of a recording as Foxglove does; prints how many there are of each topic.
import { open } from "node:fs/promises";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
    if (bytesRead !== bytes.length) throw new Error(`only ${bytesRead} of ${length} bytes`);
    return bytes;
  },
};
const recording = await McapIndexedReader.Initialize({ readable });
const decoders = new Map();
const counts = {};
for await (const message of recording.readMessages()) {
  const channel = recording.channelsById.get(message.channelId);
  if (!decoders.has(channel.id)) {
    const schema = recording.schemasById.get(channel.schemaId);
    const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
    decoders.set(channel.id, new MessageReader(definitions));
  }
  decoders.get(channel.id).readMessage(message.data);
  counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
}
console.log(JSON.stringify(counts));
