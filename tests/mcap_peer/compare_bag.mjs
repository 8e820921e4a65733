// SPDX-License-Identifier: Apache-2.0
// node compare_bag.mjs WRITTEN CSV: whether what write_bag.mjs said it wrote is what `zerodrift
// export` read, in order and to the bit.
import { linesOf, nanoseconds, table } from "./csv.mjs";

const [writtenPath, csvPath] = process.argv.slice(2);

const rates = [];
const temperatures = [];
for (const row of table(csvPath)) {
  const ns = nanoseconds(row.time_s);
  const cells = ["x", "y", "z"].map((axis) => row[`rate_${axis}_rad_s`]);
  if (cells[0] !== "") rates.push([ns, ...cells.map(Number)]);
  if (row.temperature_coil_degC !== "") temperatures.push([ns, Number(row.temperature_coil_degC)]);
}

const written = { imu: [], temperature: [] };
for (const line of linesOf(writtenPath)) {
  const [kind, ns, ...values] = line.split(" ");
  written[kind].push([ns, ...values.map(Number)]);
}
const compare = (what, found, expected) => {
  if (found.length !== expected.length || found.length === 0)
    throw new Error(`${what}: ${found.length} read, ${expected.length} written`);
  found.forEach((values, i) => {
    if (!values.every((value, k) => Object.is(value, expected[i][k])))
      throw new Error(`${what} ${i}: read ${values}, written ${expected[i]}`);
  });
  console.log(`${what}: ${found.length} messages are read as they were written`);
};
compare("rates", rates, written.imu);
compare("temperatures", temperatures, written.temperature);
