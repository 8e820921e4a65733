// SPDX-License-Identifier: Apache-2.0
// node compare.mjs MESSAGES CSV TOPIC: whether what read.mjs printed of a topic is what `zerodrift
// export` made of the same file. Numbers are compared to the bit: both sides print them so that they
// read back the same.
import { linesOf, nanoseconds, table } from "./csv.mjs";

const axes = ["x", "y", "z"];
const fail = (why) => {
  console.error(why);
  process.exit(1);
};

const [messagesPath, csvPath, topic] = process.argv.slice(2);
const messages = linesOf(messagesPath)
  .filter((line) => line.startsWith(`{"gyro_id"`))
  .map((line) => JSON.parse(line));
const rows = table(csvPath).filter((row) => row.sequence !== "");
if (rows.length === 0) fail(`${csvPath}: has no row`);
if (messages.length !== rows.length) fail(`${messages.length} messages, ${rows.length} rows`);
messages.sort((a, b) => (BigInt(a.sequence_number) < BigInt(b.sequence_number) ? -1 : 1));
rows.forEach((row, i) => {
  const message = messages[i];
  const equal = (what, found, expected) => {
    if (found !== expected) fail(`row ${i}: ${what} is ${found} in the CSV, ${expected} in the message`);
  };
  equal("sequence", row.sequence, message.sequence_number);
  equal("time", nanoseconds(row.time_s), message.sensor_time_ns);
  axes.forEach((axis, k) => {
    const rate = row[`rate_${axis}_rad_s`];
    if (rate !== undefined && rate !== "") equal(`rate ${axis}`, Number(rate), message.rate_radps[k]);
    if (topic !== "compensated_rate") return;
    equal(`drift ${axis}`, Number(row[`applied_drift_${axis}_rad_s`]), message.applied_drift_radps[k]);
    const sigma = row[`drift_sigma_${axis}_rad_s`];
    if (sigma !== "") equal(`sigma ${axis}`, Number(sigma), Math.sqrt(message.drift_variance_radps2[k]));
  });
});
console.log(`${topic}: ${rows.length} messages equal the CSV's rows`);
