// SPDX-License-Identifier: Apache-2.0
// A record that `zerodrift export` wrote, as rows of texts by their column's name.
import { readFileSync } from "node:fs";

export const linesOf = (path) => readFileSync(path, "utf8").split("\n").filter((line) => line);

export function table(path) {
  const lines = linesOf(path).filter((line) => !line.startsWith("#"));
  const header = lines[0].split(",");
  return lines.slice(1).map((line) => {
    const cells = line.split(",");
    return Object.fromEntries(header.map((name, i) => [name, cells[i]]));
  });
}

// "12.345678901" s as nanoseconds, exactly.
export const nanoseconds = (text) => {
  const [whole, fraction = ""] = text.split(".");
  return (BigInt(whole) * 1000000000n + BigInt(fraction.padEnd(9, "0"))).toString();
};
