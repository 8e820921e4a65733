#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Scores the JSON of `zerodrift diagnose` against the truth files: all goals, with counts.

    score.py --cases DIR --truth DIR --results DIR [--table out.md] [--json out.json]

RESULTS/<case>.json is what diagnose wrote; RESULTS/<case>.run.json, if there, says {"cpu_s", "wall_s", "exit_code",
"timed_out"}. A case without a readable result counts as failed in every rate of its class. Standard library only.
"""
import argparse
import collections
import json
import math
import pathlib
import sys

CREDIBLE = 0.95
STRONG_D = 12.0
SEPARABLE_D = 6.0
WORSE = 1.05
SMALLEST_GAP = 0.05  # of the oracle's RMS: below it there is no gap to close
OF_ALL_AXES = {"sensor_lag", "dropped_samples"}  # of the record's thermometers and rows, which its axes share
ALSO_TRUE = {"wild_sample": "spikes", "few_digits": "rounding"}  # what the hardship itself is called
RELIABILITY_EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)
LARGEST_ECE = 0.05
SHORT_LAG_S = 120.0  # the design merges coil_lag with tau -> 0 into shupe; the catalogue's lags start here


def wilson(hits, total, z=1.96):
    """95 % interval of a rate."""
    if total == 0:
        return (0.0, 1.0)
    rate = hits / total
    centre = (rate + z * z / (2 * total)) / (1 + z * z / total)
    half = z / (1 + z * z / total) * math.sqrt(rate * (1 - rate) / total + z * z / (4 * total * total))
    return (max(0.0, centre - half), min(1.0, centre + half))


def median(values):
    ordered = sorted(values)
    n = len(ordered)
    if n == 0:
        return None
    return ordered[n // 2] if n % 2 else 0.5 * (ordered[n // 2 - 1] + ordered[n // 2])


def quantile(values, part):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))] if ordered else None


def canonical(name, parameters=None):
    """Name after the one equivalence of the design: a coil_lag shorter than two minutes is a shupe."""
    tau = (parameters or {}).get("tau_s")
    return "shupe" if name == "coil_lag" and tau is not None and tau <= SHORT_LAG_S else name


def credible_set(effect):
    """Names, most probable first, until their probabilities add up to 95 %."""
    entries = [(effect.get("probability", 0.0), canonical(effect["name"], effect.get("parameters")))]
    entries += [(a.get("probability", 0.0), canonical(a["name"], a.get("parameters")))
                for a in effect.get("alternatives") or []]
    names, total = [], 0.0
    for probability, name in sorted(entries, key=lambda e: -e[0]):
        if total >= CREDIBLE:
            break
        total += probability
        if name not in names:
            names.append(name)
    return names


def strongest_first(effects):
    """By evidence where given; otherwise in the order of the file."""
    return sorted(effects, key=lambda e: -(e.get("log_evidence") or 0.0))


class Finding:
    """What one axis of a result says."""

    def __init__(self, axis_json, also_true=None):
        self.effects = [e for e in strongest_first(axis_json.get("effects") or []) if e["name"] != also_true]
        self.names = [canonical(e["name"], e.get("parameters")) for e in self.effects]
        self.sets = [credible_set(e) for e in self.effects]
        self.recalibrated = {r["name"] for r in axis_json.get("recalibrated") or []}
        self.unknown = axis_json.get("unknown") is not None
        self.formulas = [f["formula"] for f in (axis_json.get("unknown") or {}).get("formulas") or []]
        self.undecidable = axis_json.get("verdict") == "undecidable"
        self.gap = axis_json.get("gap") or {}

    def found(self, name):
        """angle_random_walk is in every model: more of it is a recalibration, and reported as such is right."""
        return name in self.names or (name == "angle_random_walk" and name in self.recalibrated)

    def top(self, name):
        if self.names:
            return self.names[0] == name
        return name == "angle_random_walk" and name in self.recalibrated

    def in_set(self, name):
        if any(name in names for names in self.sets):
            return True
        return name == "angle_random_walk" and name in self.recalibrated

    def certain_names(self):
        """Told without another that it might be: the set holds it alone."""
        return [name for name, e in zip(self.names, self.effects) if not e.get("alternatives")]

    def label(self):
        if self.unknown:
            told = "unknown" + (f" as {' and '.join(self.formulas)}" if self.formulas else "")
            return told + (" + " + " + ".join(self.names) if self.names else "")
        return " + ".join(self.names) or ("recalibrated " + " + ".join(sorted(self.recalibrated))
                                          if self.recalibrated else "undecidable" if self.undecidable else "nothing")


class Result:
    """One case's truth and what diagnose said, or None where it said nothing readable."""

    def __init__(self, truth, report, run):
        self.truth, self.run = truth, run or {}
        self.verdict = report.get("verdict") if report else None
        axes = (report or {}).get("axis") or {}
        self.failed = report is None or truth["axis"] not in axes
        self.main = Finding(axes.get(truth["axis"], {}), ALSO_TRUE.get(self.hardship))
        self.others = {axis: Finding(value) for axis, value in axes.items() if axis != truth["axis"]}
        self.says_unknown = self.main.unknown or self.verdict == "unknown_effect" and not any(
            f.unknown for f in self.others.values())

    @property
    def name(self):
        return self.truth["case"]

    @property
    def hardship(self):
        return self.truth.get("hardship", {}).get("name")

    @property
    def true_names(self):
        return [e["name"] for e in self.truth["effects"]]


class Rate:
    """A count, its goal and the cases that missed it."""

    def __init__(self, title, goal, at_least=True):
        self.title, self.goal, self.at_least = title, goal, at_least
        self.hits, self.total = 0, 0

    def add(self, hit):
        self.total += 1
        self.hits += bool(hit)

    def row(self):
        low, high = wilson(self.hits, self.total)
        sign = "≥" if self.at_least else "≤"
        goal = f"{sign} {100 * self.goal:.0f} %" if self.goal is not None else ""
        if self.total == 0:
            return (self.title, goal, "no case", "", "")
        rate = self.hits / self.total
        met = "" if self.goal is None else ("yes" if (rate >= self.goal if self.at_least else rate <= self.goal)
                                            else "**no**")
        return (self.title, goal, f"{self.hits}/{self.total} = {100 * rate:.1f} %",
                f"{100 * low:.1f} to {100 * high:.1f} %", met)


def value_row(title, goal, value, count, at_least, unit=""):
    if value is None:
        return (title, goal, "no case", "", "")
    number = float(goal.split()[1])
    met = value >= number if at_least else value <= number
    return (title, goal, f"{value:.3f}{unit} (n = {count})", "", "yes" if met else "**no**")


def true_d(result):
    return result.truth["effects"][0]["d"]


def separation(result):
    """d of what is left of the waveform beside the nearest effect of the catalogue; None where there is no waveform."""
    effect = result.truth["effects"][0]
    nearest = effect.get("nearest")
    return effect["d"] * math.sqrt(1 - nearest["share"]) if nearest else None


def is_right(result):
    """A case that hides something: the first name right and no unknown rest; both named; or unknown flagged."""
    if result.failed:
        return False
    kind = result.truth["class"]
    if kind == "unknown":
        return result.says_unknown
    if kind == "double":
        return all(result.main.found(name) for name in result.true_names)
    return result.main.top(result.true_names[0]) and not result.says_unknown


def score_null(results, failures):
    named = Rate("null: a false name", 0.02, at_least=False)
    unknown = Rate("null: falsely `unknown_effect`", None, at_least=False)
    recalibrated = Rate("null: wrong parameter found again (all of a case)", None)
    for r in results:
        false_name = r.failed or bool(r.main.effects)
        named.add(false_name)
        unknown.add(r.says_unknown)
        wanted = {c["name"] for c in r.truth["recalibrated"]}
        if wanted:
            recalibrated.add(not r.failed and wanted <= r.main.recalibrated)
        if false_name or r.says_unknown:
            failures.append((r, "false finding"))
    return [named.row(), unknown.row(), recalibrated.row()]


def score_single(results, failures):
    strong = Rate(f"single, d ≥ {STRONG_D:.0f}: first name right", 0.90)
    weak = Rate(f"single, d 8 to {STRONG_D:.0f}: first name right", 0.80)
    separable = Rate(f"single, d beside the nearest effect ≥ {SEPARABLE_D:.0f}: first name right", None)
    in_set = Rate("single: truth in the 95 % set", 0.97)
    extra = Rate("single: a name too many", None, at_least=False)
    sizes = []
    for r in results:
        name = r.true_names[0]
        right = is_right(r)
        (strong if true_d(r) >= STRONG_D else weak).add(right)
        if separation(r) is not None and separation(r) >= SEPARABLE_D:
            separable.add(right)
        held = not r.failed and r.main.in_set(name)
        in_set.add(held)
        extra.add(len(r.main.names) > 1)
        if r.main.sets:
            hit = [s for s in r.main.sets if name in s]
            sizes.append(len((hit or r.main.sets)[0]))
        if not right:
            failures.append((r, "first name wrong" + ("" if held else ", not in the set")))
    return [strong.row(), weak.row(), separable.row(), in_set.row(),
            value_row("single: mean size of the 95 % set", "≤ 1.5", sum(sizes) / len(sizes) if sizes else None,
                      len(sizes), False), extra.row()]


def score_double(results, failures):
    both = Rate("two effects: both named", 0.75)
    precision = Rate("two effects: names that are true", 0.90)
    for r in results:
        right = is_right(r)
        both.add(right)
        for name in r.main.names:
            precision.add(name in r.true_names)
        if not right or any(name not in r.true_names for name in r.main.names):
            failures.append((r, "both named, and a false one" if right else "not both"))
    return [both.row(), precision.row()]


def score_unknown(results, failures):
    flagged = Rate("unknown effect: flagged", 0.80)
    strong = Rate(f"unknown effect, d ≥ {STRONG_D:.0f}: flagged", None)
    formula = Rate("unknown effect: told by a formula that held-out data confirm", None)
    wrong = Rate("unknown effect: a wrong name and no other that it might be", 0.10, at_least=False)
    for r in results:
        said = is_right(r)
        certain = r.main.certain_names()
        flagged.add(said)
        if true_d(r) >= STRONG_D:
            strong.add(said)
        wrong.add(bool(certain))
        formula.add(bool(r.main.formulas))
        if not said or certain:
            failures.append((r, "wrong certain name" if certain else "not flagged"))
    return [flagged.row(), strong.row(), formula.row(), wrong.row()]


def gap_closed(result):
    """(before - after)/(before - oracle) of the validation record, or None where there is no gap a twin could close."""
    if result.hardship == "short":  # proved on blocks of its own: another oracle
        return None
    oracle = result.truth["validation"]["oracle_rms_deg_h"]
    effects = result.truth["effects"]
    held_out = result.main.gap.get("held_out") or {}
    if not effects or not all(e["removable"] for e in effects):
        return None
    before, after = held_out.get("before_rms_deg_h"), held_out.get("after_rms_deg_h")
    if before is None or after is None:
        before, after = result.truth["validation"]["before_rms_deg_h"], None
    if before - oracle < SMALLEST_GAP * oracle:
        return None
    return 0.0 if after is None else (before - after) / (before - oracle)


def score_proof(results, failures):
    """Gap, Allan distance and harm over all classes."""
    known = [r for r in results if r.truth["class"] in ("single", "double")]
    gaps = [g for g in map(gap_closed, known) if g is not None]
    unknown_gaps = [g for g in map(gap_closed, (r for r in results if r.truth["class"] == "unknown")) if g is not None]
    allan = [r.main.gap["allan_log_distance"]["after"] for r in results
             if (r.main.gap.get("allan_log_distance") or {}).get("after") is not None]
    worse = Rate("held-out RMS worse by more than 5 %", 0.02, at_least=False)
    differs = Rate("`before` within 10 % of the generator's own", None)
    for r in results:
        held_out = r.main.gap.get("held_out") or {}
        before, after = held_out.get("before_rms_deg_h"), held_out.get("after_rms_deg_h")
        if before is None or after is None:
            continue
        worse.add(after > WORSE * before)
        own = r.truth["validation"]["before_rms_deg_h"]
        if r.hardship != "short":
            differs.add(abs(before - own) <= 0.1 * own)
        if after > WORSE * before:
            failures.append((r, f"held-out RMS from {before:.4g} to {after:.4g} deg/h"))
    return [value_row("gap closed on the unseen record, median (single, double)", "≥ 0.90", median(gaps), len(gaps),
                      True),
            ("gap closed, tenth percentile", "", f"{quantile(gaps, 0.1):.3f}" if gaps else "no case", "", ""),
            value_row("unknown gap closed on the unseen record, median", "≥ 0.70", median(unknown_gaps),
                      len(unknown_gaps), True),
            ("unknown gap closed, tenth percentile", "",
             f"{quantile(unknown_gaps, 0.1):.3f}" if unknown_gaps else "no case", "", ""),
            value_row("Allan log-distance after, median", "≤ 0.10", median(allan), len(allan), False),
            worse.row(), differs.row()]


def statements(results):
    """(stated probability, true) of every name and every alternative to it, beside what was hidden."""
    stated = []
    for r in results:
        for effect in r.main.effects:
            entries = [effect, *(effect.get("alternatives") or [])]
            stated += [(e.get("probability", 0.0), canonical(e["name"], e.get("parameters")) in r.true_names)
                       for e in entries]
    return stated


def reliability(stated):
    """Of each bin that holds any: (low, high, mean stated probability, how many are true, how many)."""
    bins = []
    for low, high in zip(RELIABILITY_EDGES, RELIABILITY_EDGES[1:]):
        inside = [(p, hit) for p, hit in stated if low <= p < high or p >= high == RELIABILITY_EDGES[-1]]
        if inside:
            bins.append((low, high, sum(p for p, _ in inside) / len(inside), sum(hit for _, hit in inside), len(inside)))
    return bins


def calibration_error(stated):
    """Expected calibration error (Naeini, Cooper, Hauskrecht 2015): mean distance of stated from reached, by bins."""
    if not stated:
        return None
    return sum(abs(mean * n - hits) for _, _, mean, hits, n in reliability(stated)) / len(stated)


def score_probabilities(results):
    names = [(e.get("probability", 0.0), name in r.true_names)
             for r in results for name, e in zip(r.main.names, r.main.effects)]
    brier = sum((p - hit) ** 2 for p, hit in names) / len(names) if names else None
    stated = statements(results)
    return [value_row("probability of a name: expected calibration error", f"≤ {LARGEST_ECE}", calibration_error(names),
                      len(names), False),
            value_row("... and of its alternatives", f"≤ {LARGEST_ECE}", calibration_error(stated), len(stated),
                      False),
            ("probability of a name: Brier score", "", f"{brier:.3f}" if names else "no case", "", "")]


def reliability_table(results):
    out = ["Reliability, names and their alternatives:", "", "| stated | mean stated | true | 95 % interval |",
           "|---|---|---|---|"]
    for low, high, mean, hits, n in reliability(statements(results)):
        below, above = wilson(hits, n)
        out.append(f"| {low:g} to {high:g} | {mean:.3f} | {hits}/{n} = {hits / n:.3f} | {below:.3f} to {above:.3f} |")
    return out


def score_running(results):
    seconds = [r.run["cpu_s"] for r in results if r.run.get("cpu_s") is not None]
    slow = max(seconds) if seconds else None
    broken = Rate("no readable result (crash, time-out)", 0.0, at_least=False)
    for r in results:
        broken.add(r.failed)
    others = Rate("other axes of three-axis records: a false finding", 0.02, at_least=False)
    for r in results:
        for finding in r.others.values():
            others.add(bool(set(finding.names) - OF_ALL_AXES.intersection(r.true_names)) or finding.unknown)
    return [value_row("CPU seconds per case, median", "≤ 5", median(seconds), len(seconds), False, " s"),
            value_row("CPU seconds per case, largest", "≤ 5", slow, len(seconds), False, " s"), broken.row(),
            others.row()]


def score(results):
    """Rows (what, goal, reached, 95 % interval, met), failures (result, why)."""
    failures = []
    by_class = collections.defaultdict(list)
    for r in results:
        by_class[r.truth["class"]].append(r)
    rows = (score_null(by_class["null"], failures) + score_single(by_class["single"], failures) +
            score_double(by_class["double"], failures) + score_unknown(by_class["unknown"], failures) +
            score_probabilities(results) + score_proof(results, failures) + score_running(results))
    return rows, failures


def missed_bars(results, most_false_names=None, least_right=None, most_failed=None):
    """A line for each bar that is missed; None is no bar."""
    nulls = [r for r in results if r.truth["class"] == "null"]
    hiding = [r for r in results if r.truth["class"] != "null"]
    false_names = sum(r.failed or bool(r.main.effects) or r.says_unknown for r in nulls)
    right = sum(is_right(r) for r in hiding)
    failed = sum(r.failed for r in results)
    lines = []
    if most_false_names is not None and false_names > most_false_names:
        lines.append(f"found {false_names} false findings on {len(nulls)} null cases, expected at most {most_false_names}")
    if least_right is not None and right < least_right:
        lines.append(f"found {right} right of {len(hiding)} cases that hide something, expected {least_right} at least")
    if most_failed is not None and failed > most_failed:
        lines.append(f"found {failed} of {len(results)} cases without a readable result, expected {most_failed} at most")
    return lines


def confusion(results):
    """Per hidden effect of the singles: what was said first, with counts."""
    table = collections.defaultdict(collections.Counter)
    for r in results:
        if r.truth["class"] == "single":
            said = "failed" if r.failed else r.main.label()
            table[r.true_names[0]][said] += 1
    return table


def outcome(result):
    """Of a single: right; in the set; nothing said that is false (nothing, undecidable); unknown; or wrong."""
    name = result.true_names[0]
    if result.failed:
        return "failed"
    if is_right(result):
        return "right"
    if result.main.in_set(name):
        return "in the set"
    if result.main.names:
        return "wrong"
    return "unknown" if result.says_unknown else "nothing"


OUTCOMES = ["right", "in the set", "nothing", "unknown", "wrong", "failed"]


def hardship_table(results):
    """By hardship: false findings of the nulls, and what was said of the singles."""
    names = sorted({r.hardship for r in results if r.hardship})
    if not names:
        return []
    out = ["", "By hardship (false: nulls with a name or an unknown effect; the others: singles):", "",
           "| hardship | " + " | ".join(["false"] + OUTCOMES) + " |", "|---" * (2 + len(OUTCOMES)) + "|"]
    for name in names:
        mine = [r for r in results if r.hardship == name]
        nulls = [r for r in mine if r.truth["class"] == "null"]
        singles = collections.Counter(outcome(r) for r in mine if r.truth["class"] == "single")
        false = sum(r.failed or bool(r.main.effects) or r.says_unknown for r in nulls)
        out.append(f"| {name} | {false}/{len(nulls)} | " +
                   " | ".join(f"{singles[o]}/{sum(singles.values())}" for o in OUTCOMES) + " |")
    ladder = [r for r in results if r.hardship == "mismatch"]
    if ladder:
        distances = sorted({r.truth["hardship"]["distance"] for r in ladder})
        out += ["", "Forms that differ, right or in the set, by share of the form (rows) and d:", "",
                "| | " + " | ".join(f"{d:g}" for d in distances) + " |", "|---" * (1 + len(distances)) + "|"]
        for share in sorted({r.truth["hardship"]["share"] for r in ladder}):
            row = []
            for d in distances:
                cell = [r for r in ladder if (r.truth["hardship"]["share"], r.truth["hardship"]["distance"]) == (share, d)]
                row.append(f"{sum(outcome(r) in ('right', 'in the set') for r in cell)}/{len(cell)}")
            out.append(f"| {share:g} | " + " | ".join(row) + " |")
    return out


def hidden_label(truth):
    if not truth["effects"]:
        return truth.get("kind") or "nothing"
    return " + ".join(f"{e['name']} (d {e['d']:.1f})" for e in truth["effects"])


def table_text(results, title=""):
    rows, failures = score(results)
    out = [f"### {title}", ""] if title else []
    counts = collections.Counter(r.truth["class"] for r in results)
    out.append(f"{len(results)} cases: " + ", ".join(f"{counts[c]} {c}" for c in ("null", "single", "double",
                                                                                    "unknown")) + ".")
    out += ["", "| what | goal | reached | 95 % interval | met |", "|---|---|---|---|---|"]
    out += ["| " + " | ".join(row) + " |" for row in rows]
    out += hardship_table(results)
    out += [""] + reliability_table(results)
    out += ["", "Single effects, what was said:", "", "| hidden | right | said |", "|---|---|---|"]
    for name, said in sorted(confusion(results).items()):
        right = sum(1 for r in results if r.truth["class"] == "single" and r.true_names[0] == name and
                    not r.failed and r.main.top(name) and not r.says_unknown)
        texts = ", ".join(f"{label} ×{count}" for label, count in said.most_common())
        out.append(f"| {name} | {right}/{sum(said.values())} | {texts} |")
    out += ["", f"Failures ({len(failures)}):", ""]
    for r, why in failures:
        said = "no result" if r.failed else r.main.label()
        nearest = [e["nearest"]["name"] + f" {e['nearest']['share']:.2f}" for e in r.truth["effects"]
                   if e.get("nearest")]
        near = f"; nearest {', '.join(nearest)}" if nearest else ""
        near += f"; {json.dumps(r.truth['hardship'])}" if r.hardship else ""
        out.append(f"- {r.name} ({r.truth['class']}): {why}; hidden: {hidden_label(r.truth)}; said: {said}{near}")
    return "\n".join(out) + "\n"


def read_json(path):
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def load_results(truth_folder, results_folder):
    """One Result for each truth file, with or without an answer."""
    results = []
    for path in sorted(pathlib.Path(truth_folder).glob("*.json")):
        truth = json.loads(path.read_text())
        folder = pathlib.Path(results_folder)
        results.append(Result(truth, read_json(folder / f"{path.stem}.json"),
                              read_json(folder / f"{path.stem}.run.json")))
    return results


def put_table(text, path):
    """Prints it, and writes it where there is a path."""
    print(text, end="")
    if path:
        pathlib.Path(path).write_text(text)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", help="checked to hold no truth file")
    parser.add_argument("--truth", required=True)
    parser.add_argument("--results", required=True)
    parser.add_argument("--table", help="also write the table here")
    parser.add_argument("--title", default="")
    options = parser.parse_args(argv)
    if options.cases and any(pathlib.Path(options.cases).rglob("*.json")):
        print(f"{options.cases} holds JSON files: a truth beside its case is not blind", file=sys.stderr)
        return 2
    results = load_results(options.truth, options.results)
    if not results:
        print(f"no truth files in {options.truth}", file=sys.stderr)
        return 2
    text = table_text(results, options.title)
    put_table(text, options.table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
