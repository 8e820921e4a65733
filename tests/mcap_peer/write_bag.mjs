// SPDX-License-Identifier: Apache-2.0
// node write_bag.mjs FOLDER: a bag of ROS 2 as rosbag2's MCAP storage writes it, two files and a
// metadata.yaml, with @mcap/core and messages serialised by their ros2msg definitions. Prints what
// is in it, a line a message: topic, stamp in ns, values. Half of the Imu messages are big-endian.
import { mkdir, open, writeFile } from "node:fs/promises";

import { CdrWriter, EncapsulationKind } from "@foxglove/cdr";
import { parse } from "@foxglove/rosmsg";
import { MessageWriter } from "@foxglove/rosmsg2-serialization";
import { McapWriter } from "@mcap/core";
import lz4 from "lz4js";

const separator = "=".repeat(80);
const parts = {
  "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id\n",
  "builtin_interfaces/Time": "int32 sec\nuint32 nanosec\n",
  "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n",
  "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z\n",
};
const definition = (text, needs) =>
  [text, ...needs.map((name) => `${separator}\nMSG: ${name}\n${parts[name]}`)].join("");
const imuText = definition(
  "# from the IMU\nstd_msgs/Header header\n\ngeometry_msgs/Quaternion orientation\n" +
    "float64[9] orientation_covariance # Row major about x, y, z axes\n\n" +
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\n" +
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
  Object.keys(parts),
);
const temperatureText = definition(
  "std_msgs/Header header\nfloat64 temperature # degC\nfloat64 variance # 0 is interpreted as variance unknown\n",
  ["std_msgs/Header", "builtin_interfaces/Time"],
);
const writeImu = new MessageWriter(parse(imuText, { ros2: true }));
const writeTemperature = new MessageWriter(parse(temperatureText, { ros2: true }));

// The library writes little-endian alone.
function bigEndian(imu) {
  const cdr = new CdrWriter({ kind: EncapsulationKind.CDR_BE });
  const { stamp, frame_id } = imu.header;
  cdr.int32(stamp.sec).uint32(stamp.nanosec).string(frame_id);
  const vector = ({ x, y, z }) => [x, y, z].forEach((value) => cdr.float64(value));
  const matrix = (values) => values.forEach((value) => cdr.float64(value));
  vector(imu.orientation);
  cdr.float64(imu.orientation.w);
  matrix(imu.orientation_covariance);
  vector(imu.angular_velocity);
  matrix(imu.angular_velocity_covariance);
  vector(imu.linear_acceleration);
  matrix(imu.linear_acceleration_covariance);
  return cdr.data;
}

// xorshift32: the same values each time, with all 53 bits.
let state = 1;
const bits = () => {
  state ^= state << 13;
  state ^= state >>> 17;
  state ^= state << 5;
  return state >>> 0;
};
const number = () => ((bits() * 2097152 + (bits() >>> 11)) / 2 ** 53 - 0.5) * 1e-3;
const header = (ns) => ({
  stamp: { sec: Number(ns / 1000000000n), nanosec: Number(ns % 1000000000n) },
  frame_id: "imu_link".slice(0, Number(ns % 9n)),
});
const none = [-1, 0, 0, 0, 0, 0, 0, 0, 0];

class File {
  async create(path, compress) {
    this.handle = await open(path, "w");
    let position = 0n;
    const writable = {
      position: () => position,
      write: async (bytes) => {
        await this.handle.write(bytes);
        position += BigInt(bytes.length);
      },
    };
    const compressChunk = compress
      ? (data) => ({ compression: "lz4", compressedData: lz4.compress(data) })
      : undefined;
    this.writer = new McapWriter({ writable, chunkSize: 4096, compressChunk });
    await this.writer.start({ profile: "ros2", library: "libmcap 0.8.0" });
    this.channels = {};
    return this;
  }
  async add(topic, type, text) {
    const schemaId = await this.writer.registerSchema({
      name: type,
      encoding: "ros2msg",
      data: new TextEncoder().encode(text),
    });
    this.channels[topic] = await this.writer.registerChannel({
      schemaId,
      topic,
      messageEncoding: "cdr",
      metadata: new Map([["offered_qos_profiles", "- history: 1\n  depth: 10\n"]]),
    });
  }
  async put(topic, logTime, data) {
    // As rosbag2: no sequence numbers.
    await this.writer.addMessage({ channelId: this.channels[topic], sequence: 0, logTime, publishTime: logTime, data });
  }
  async end() {
    await this.writer.end();
    await this.handle.close();
  }
}

const [folder] = process.argv.slice(2);
await mkdir(folder, { recursive: true });
const start = 1700000000123456789n;
const messages = 2000; // in each file, at 200 Hz
for (let part = 0; part < 2; ++part) {
  const file = await new File().create(`${folder}/run_${part}.mcap`, part === 1);
  const imus = () => file.add("/imu/data_raw", "sensor_msgs/msg/Imu", imuText);
  const temperatures = () => file.add("/imu/temperature", "sensor_msgs/msg/Temperature", temperatureText);
  // Ids are a file's own.
  await (part === 0 ? imus() : temperatures());
  await (part === 0 ? temperatures() : imus());
  for (let n = 0; n < messages; ++n) {
    const ns = start + BigInt(part * messages + n) * 5000000n;
    const imu = {
      header: header(ns),
      orientation: { x: 0, y: 0, z: 0, w: 1 },
      orientation_covariance: none,
      angular_velocity: { x: number(), y: number(), z: number() },
      angular_velocity_covariance: [1e-8, 0, 0, 0, 1e-8, 0, 0, 0, 1e-8],
      linear_acceleration: { x: 0, y: 0, z: 9.81 },
      linear_acceleration_covariance: none,
    };
    const logTime = ns + 700000n;
    await file.put("/imu/data_raw", logTime, n % 2 === 0 ? writeImu.writeMessage(imu) : bigEndian(imu));
    const { x, y, z } = imu.angular_velocity;
    console.log("imu", ns.toString(), x, y, z);
    if (n % 200 !== 0) continue;
    const degc = 20 + 1e3 * number();
    const reading = { header: header(ns), temperature: degc, variance: 0 };
    await file.put("/imu/temperature", logTime, writeTemperature.writeMessage(reading));
    console.log("temperature", ns.toString(), degc);
  }
  await file.end();
}
await writeFile(
  `${folder}/metadata.yaml`,
  "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n" +
    "  relative_file_paths:\n    - run_0.mcap\n    - run_1.mcap\n" +
    '  compression_format: ""\n  compression_mode: ""\n',
);
