"""The score of a blind trial: key against answers."""
import collections
import math

# Names and units of the same coefficient differ where the physics file holds more than one form of an effect.
TRUTH_NAME = {"tau_s": "tau"}
NO_COEFFICIENTS = {
    "gyro_magnetic_sensitivity",   # the field that the diagnosis assumes is not the true one: another scale
    "base_sway", "base_settling",  # concealed along the vehicle's axes, found along n
}
SHARES_NAME = {"gyro_scale_temperature", "accel_scale_temperature"}   # per degC concealed, found as a warm-up
DEGREE_PER_HOUR = math.pi / 180.0 / 3600.0


def binomial_tail(k, n, p):
    """P(X >= k)."""
    if k <= 0:
        return 1.0
    if k > n or p <= 0.0:
        return 0.0
    if p >= 1.0:
        return 1.0
    logs = [math.lgamma(n + 1) - math.lgamma(j + 1) - math.lgamma(n - j + 1) + j * math.log(p)
            + (n - j) * math.log1p(-p) for j in range(k, n + 1)]
    top = max(logs)
    return min(1.0, math.exp(top) * math.fsum(math.exp(x - top) for x in logs))


def upper_bound(k, n, confidence=0.95):
    """Clopper and Pearson: the rate above which k or fewer of n have probability below 1 - confidence."""
    if n == 0 or k == n:
        return 1.0
    low, high = k / n, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if 1.0 - binomial_tail(k + 1, n, middle) > 1.0 - confidence:
            low = middle
        else:
            high = middle
    return high


def lower_bound(k, n, confidence=0.95):
    return 1.0 - upper_bound(n - k, n, confidence)


def chi_squared_tail(x, degrees):
    """P(chi-squared > x): Q(1/2) and Q(1) in closed form, Q(a + 1) = Q(a) + x^a e^-x / Gamma(a + 1)."""
    half = 0.5 * x
    a = 0.5 if degrees % 2 else 1.0
    tail = math.erfc(math.sqrt(half)) if degrees % 2 else math.exp(-half)
    while a < 0.5 * degrees - 0.25:
        tail += math.exp(a * math.log(half) - half - math.lgamma(a + 1.0))
        a += 1.0
    return tail


def chi_squared_above(p, degrees):
    """x with P(chi-squared > x) = p."""
    low, high = 1e-9, 1000.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if chi_squared_tail(middle, degrees) > p else (low, middle)
    return low


def power(square, degrees, p):
    """Of the chi-squared test of size p: a Poisson mixture of central ones, mean square/2 (non-central chi-squared)."""
    x, mean = chi_squared_above(p, degrees), 0.5 * square
    most = int(mean + 12.0 * math.sqrt(mean) + 30.0)
    return min(1.0, math.fsum(math.exp(j * math.log(mean) - mean - math.lgamma(j + 1.0)) * chi_squared_tail(x, degrees + 2 * j)
                              for j in range(most)))


def rms(values):
    return math.sqrt(math.fsum(v * v for v in values) / len(values)) if values else math.nan


def middle(values):
    return sorted(map(abs, values))[len(values) // 2] if values else math.nan


def share(k, n):
    return f"{k}/{n} = {100.0 * k / n:.1f} %" if n else "none"


def names(answer, deterministic=True):
    return [f["effect"] for f in answer.get("findings", []) if not (deterministic and f["stochastic"])]


def class_of(finding):
    return {finding["effect"], *finding["class"]}


def alarmed(answer):
    return answer.get("mismatch", True)   # a failed diagnosis says at least that something is wrong


def unexplained_only(answer):
    """None of the above, or a mismatch that no equation is named for."""
    return alarmed(answer) and not names(answer) or answer.get("unexplained", False)


def truths(case):
    return {e["id"]: e for e in case["effects"]}


def errors(case, value):
    """Error of the 24 over the bound of a filter that knows effect, direction and constants, not the size."""
    bound = [0.0] * 24
    for e in case["effects"]:
        if "sigma_24" not in e:
            return None
        for k in range(24):
            bound[k] = max(bound[k], e["sigma_24"][k] ** 2)
    for e in case["effects"]:
        for k in range(24):
            bound[k] += (e["shift"][k] / e["sigmas"]) ** 2
    return [(value[k] - case["truth"][k]) / math.sqrt(bound[k]) for k in range(24)]


def augmented_errors(case, value):
    """The same over the bound of the augmented model: all of the effect's coefficients and constants estimated."""
    sigma = case["effects"][0].get("augmented_sigma_24")
    return [(v - t) / s for v, t, s in zip(value, case["truth"], sigma)] if sigma else []


class Score:
    def __init__(self, cases, answers):
        self.cases = cases
        self.answers = answers
        self.lines = []
        self.failed = []
        self.clean()
        self.strengths()
        self.pairs()
        self.outside()
        self.noise()
        self.coverage()
        self.parameters()
        self.rivals()
        cost = [answers[c["number"]].get("cpu_s", math.nan) for c in cases]   # a batch keeps none in its results
        self.say(f"cost: {sum(cost):.0f} s of CPU for {len(cost)} diagnoses, longest {max(cost, default=0):.1f} s")

    def say(self, line=""):
        self.lines.append(line)

    def text(self):
        return "\n".join(self.lines) + "\n"

    def contradictions(self):
        return self.failed

    def of(self, *strata):
        return [(c, self.answers[c["number"]]) for c in self.cases if c["stratum"] in strata]

    def at_most(self, what, k, n, rate):
        if n and binomial_tail(k, n, rate) < 0.01:
            self.failed.append(f"{what}: {share(k, n)}, at most {100 * rate:g} % asked for")

    def at_least(self, what, k, n, rate):
        self.at_most("the rest of " + what, n - k, n, 1.0 - rate)

    def clean(self):
        pairs = self.of("clean")
        wrong = [(c, a) for c, a in pairs if alarmed(a)]
        self.say(f"clean recordings: {len(pairs)}")
        self.say(f"  false alarms {share(len(wrong), len(pairs))}, upper 95 % bound "
                 f"{100 * upper_bound(len(wrong), len(pairs)):.2f} %")
        for c, a in wrong:
            self.say(f"    case {c['number']}: {a['verdict']}, {names(a, False)}, faults {a.get('data_faults', [])}, "
                     f"moored {c['moored']}, NIS {a['after']['nis']:.2f}, map {a['after']['map']:.1f}, "
                     f"log p white {a['after']['log_p_white']:.1f}" if "after" in a else f"    case {c['number']}: failed")
        uncertain = sum(a["verdict"] == "not enough information" for _, a in pairs)
        self.say(f"  not enough information: {share(uncertain, len(pairs))}")
        self.at_most("false alarms", len(wrong), len(pairs), 0.01)

    def judged(self, case, answer):
        """named right, in the class, another name, unexplained, silent."""
        truth = set(truths(case))
        found = [f for f in answer.get("findings", []) if not f["stochastic"]]
        if found and found[0]["effect"] in truth:
            return "right"
        if found and class_of(found[0]) & truth:
            return "class"
        if found:
            return "other"
        return "unexplained" if alarmed(answer) else "silent"

    def strengths(self):
        groups = collections.defaultdict(list)
        drawn = [(c, a) for c, a in self.of("range") if c["effects"][0]["sigmas"] >= 5.9]   # some cannot be made so strong
        for c, a in self.of("single", "invisible"):
            s = c["effects"][0]["sigmas"]
            low = max((b for b in (0.0, 0.2, 0.6, 1.8, 5.9, 9.5, 20.0) if s >= b), default=0.0)
            groups[low].append((c, a))
        self.say()
        self.say("detection over strength (size over the bound of its sigma), effects of the catalogue and invisible")
        self.say("  (possible: power of the test of the very coefficients drawn, direction unknown, at the limit in use)")
        self.say("  strength    n  detected  possible  named: truth  class  other  unexplained  silent")
        for low in sorted(groups):
            g = groups[low]
            count = collections.Counter(self.judged(c, a) for c, a in g)
            middle = sorted(c["effects"][0]["sigmas"] for c, _ in g)[len(g) // 2]
            detected = sum(alarmed(a) for _, a in g)
            possible = sum(self.possible(c, a) for c, a in g) / len(g)
            self.say(f"  {middle:8.2f} {len(g):4d}  {100 * detected / len(g):6.1f} %  {100 * possible:6.1f} % {count['right']:13d} "
                     f"{count['class']:6d} {count['other']:6d} {count['unexplained']:12d} {count['silent']:7d}")
        near = groups.pop(5.9, [])          # exactly 6: the hardest of all
        strong = [x for low, g in groups.items() if low >= 5.9 for x in g] + drawn
        self.say("  drawn, every logarithm from 6 to 100 sigma as likely:")
        for low, high in ((5.9, 9.5), (9.5, 20.0), (20.0, 1e9)):
            g = [(c, a) for c, a in drawn if low <= c["effects"][0]["sigmas"] < high]
            if g:
                self.say(f"    {low:4.1f}..: {self.detected_and_named(g)}")
        weak = [x for low, g in groups.items() if low < 0.6 for x in g]
        detected = sum(alarmed(a) for _, a in strong)
        right = sum(self.judged(c, a) in ("right", "class") for c, a in strong)
        size = [len(class_of(a["findings"][0])) for c, a in strong if self.judged(c, a) in ("right", "class")]
        named = sum(bool(names(a, False)) for _, a in weak)
        for title, g in (("6 sigma and more, 10 and drawn", strong), ("  one coefficient", self.concealing(strong, True)),
                         ("  several", self.concealing(strong, False)), ("exactly 6 sigma", near)):
            self.say(f"  {title}: {self.detected_and_named(g)}")
        if size:
            self.say(f"  names in a class that holds the truth: {sum(size) / len(size):.2f}")
        self.say(f"  below 0.6 sigma: named {share(named, len(weak))}")
        probability = [self.probability(c, a) for c, a in strong]
        if probability:
            self.say(f"  mean probability on the truth, 6 sigma and more: {sum(probability) / len(probability):.3f}")
        gains = sorted(a["findings"][0]["held_out_gain"] for c, a in strong if self.judged(c, a) in ("right", "class"))
        if gains:
            positive = sum(g > 0.0 for g in gains)
            self.say(f"  held-out gain of right names: positive in {share(positive, len(gains))}, "
                     f"median {gains[len(gains) // 2]:.1f}")
        self.at_least("detection at 6 sigma and more", detected, len(strong), 0.99)
        self.at_least("right class at 6 sigma and more", right, len(strong), 0.95)
        self.at_most("names below 0.6 sigma", named, len(weak), 0.01)
        self.confusion(near + strong)

    @staticmethod
    def coefficients_drawn(case):
        """How many of an effect's coefficients are concealed: one, or all that it has."""
        skipped = ("tau_s", "reference_c", "width", "period_s", "phase", "field_north", "field_up", "field_east")
        return max(1, sum(v != 0.0 for k, v in case["effects"][0]["values"].items() if k not in skipped))

    def concealing(self, pairs, one):
        return [(c, a) for c, a in pairs if (self.coefficients_drawn(c) == 1) == one]

    def detected_and_named(self, pairs):
        if not pairs:
            return "none"
        n = len(pairs)
        detected = sum(alarmed(a) for _, a in pairs)
        right = sum(self.judged(c, a) in ("right", "class") for c, a in pairs)
        possible = sum(self.possible(c, a) for c, a in pairs) / n
        chance = 1.0 - binomial_tail(detected + 1, n, possible)
        return (f"detected {share(detected, n)} (possible {100 * possible:.1f} %; so few by chance: {100 * chance:.0f} %), "
                f"class right {share(right, n)}")

    def possible(self, case, answer):
        """Power where the strength is that of one coefficient, or is spread over all of the group at random."""
        limit = math.exp(answer.get("log_p_limit", math.log(chi_squared_tail(4.1 ** 2, 1))))
        return power(case["effects"][0]["sigmas"] ** 2, self.coefficients_drawn(case), limit)

    def probability(self, case, answer):
        """On the true name; shared evenly over the class where the answer gives no probabilities."""
        found = [f for f in answer.get("findings", []) if not f["stochastic"]]
        for f in found:
            for truth in truths(case):
                if "probability" in f and truth in f["probability"]:
                    return f["probability"][truth]
                if truth in class_of(f):
                    return 1.0 / len(class_of(f))
        return 0.0

    def confusion(self, pairs):
        rows = collections.defaultdict(collections.Counter)
        for c, a in pairs:
            judged = self.judged(c, a)
            first = names(a)[0] if names(a) else judged
            rows[c["effects"][0]["id"]]["class" if judged == "class" else first] += 1
        self.say()
        self.say("confusion at 6 sigma and more ('class': another name stands first, the truth is in its class)")
        for truth in sorted(rows):
            said = ", ".join(f"{'itself' if name == truth else name} {n}" for name, n in rows[truth].most_common())
            self.say(f"  {truth:26s} {said}")

    def pairs(self):
        pairs = self.of("pair")
        both = one = 0
        extra = 0
        for c, a in pairs:
            found = [class_of(f) for f in a.get("findings", []) if not f["stochastic"]]
            hit = [t for t in truths(c) if any(t in f for f in found)]
            both += len(hit) == 2
            one += len(hit) == 1
            extra += sum(not (f & set(truths(c))) for f in found)
        self.say()
        self.say(f"pairs: both named {share(both, len(pairs))}, one {one}, names that are neither {extra}")

    def outside(self):
        """What a twin in the catalogue would leave of it decides whether it can be known for outside."""
        pairs = [(c, a) for c, a in self.of("outside", "unlike") if c["effects"][0]["sigmas"] >= 5.9]

        def unlike(case):
            return case["effects"][0].get("unlike_sigmas", math.inf)

        self.say()
        self.say("outside the catalogue, seen by 6 sigma and more, by what the best of its twins in the catalogue leaves")
        for low, high in ((0.0, 3.0), (3.0, 5.9), (5.9, 9.5), (9.5, 20.0), (20.0, 50.0), (50.0, math.inf)):
            g = [(c, a) for c, a in pairs if low <= unlike(c) < high]
            said = collections.Counter(names(a)[0] if names(a) else ("none of the above" if alarmed(a) else "silent")
                                       for _, a in g)
            if g:
                self.say(f"  {low:5.1f}..: n {len(g)}: " + ", ".join(f"{k} {v}" for k, v in said.most_common()))
        apart = [(c, a) for c, a in pairs if unlike(c) >= 5.9]
        for title, g in (("all", pairs), ("6 sigma and more from every twin", apart)):
            named = sum(bool(names(a)) for _, a in g)
            self.say(f"  {title}: none of the above or unexplained {share(sum(unexplained_only(a) for _, a in g), len(g))}, "
                     f"a library name {share(named, len(g))}, upper 95 % bound {100 * upper_bound(named, len(g)):.1f} %")
        for c, a in pairs:
            if names(a):
                self.say(f"    case {c['number']}: {c['effects'][0]['id']} {c['effects'][0]['sigmas']:.0f} sigma, "
                         f"{c['effects'][0].get('unlike_sigmas', math.nan):.1f} from its twin: "
                         f"{[sorted(class_of(f)) for f in a['findings'] if not f['stochastic']]}")
        self.at_least("none of the above outside the catalogue", sum(unexplained_only(a) for _, a in apart), len(apart), 0.8)
        self.at_most("library names outside the catalogue", sum(bool(names(a)) for _, a in apart), len(apart), 0.05)

    def noise(self):
        self.say()
        self.say("noise traps: what was said")
        rows = collections.defaultdict(collections.Counter)
        for c, a in self.of("noise"):
            said = names(a, False) or (["unexplained"] if alarmed(a) else ["silent"])
            rows[c["effects"][0]["id"]][" + ".join(sorted(set(said)))] += 1
        for truth in sorted(rows):
            self.say(f"  {truth:20s} " + ", ".join(f"{k} {v}" for k, v in rows[truth].most_common()))
        biases = sum(bool(names(a)) for _, a in self.of("noise"))
        self.say(f"  an equation named: {share(biases, len(self.of('noise')))}")

    def coefficients(self, case, answer):
        """(truth, value, sigma) of every coefficient of effects rightly named. Where one of a pair stays unnamed (a lever
        arm lies in the size effect's span) the other's coefficients stand for both, and have no truth of their own."""
        if len({f["effect"] for f in answer.get("findings", [])} & set(truths(case))) < len(truths(case)):
            return
        for f in answer.get("findings", []):
            e = truths(case).get(f["effect"])
            if e is None or f["effect"] in NO_COEFFICIENTS or f["stochastic"]:
                continue
            if f["effect"] in SHARES_NAME and "tau" in f["parameters"]:
                continue
            warm_up = "warm_up_x" in e["values"] and "tau" in f["parameters"]
            if "warm_up_x" in e["values"] and not warm_up and not case["temperature"]:
                continue
            if warm_up and case["temperature"]:
                continue              # concealed by temperature, found as a warm-up
            for name, (value, sigma) in f["parameters"].items():
                if name == "tau" and f["effect"] != "accel_gyro_time_offset":
                    yield "constant", e["values"]["tau_s"], value, sigma
                elif name == "w0":
                    yield "constant", e["values"]["width"] * DEGREE_PER_HOUR, value, sigma
                elif sigma > 0.0:
                    yield "size", e["values"]["warm_up_" + name if warm_up else name], value, sigma

    def coverage(self):
        inside = collections.Counter()
        total = collections.Counter()
        for c, a in self.of("single", "range", "pair"):
            if min(e["sigmas"] for e in c["effects"]) < 9.5:
                continue              # near the threshold only large draws are named: they cover less by selection
            for kind, truth, value, sigma in self.coefficients(c, a):
                total[kind] += 1
                inside[kind] += abs(value - truth) < 1.96 * sigma
        self.say()
        for kind in ("size", "constant"):
            self.say(f"95 % intervals, {kind} of effects rightly named at 10 sigma and more: cover "
                     f"{share(inside[kind], total[kind])}")
        n = k = 0
        for c, a in self.of("clean"):
            if "value" not in a:
                continue
            for truth, value, sigma in zip(c["truth"], a["value"], a["sigma"]):
                n += 1
                k += abs(value - truth) < 1.96 * sigma
        self.say(f"95 % intervals of the 24, clean recordings: cover {share(k, n)}")

    def parameters(self):
        sizes = collections.defaultdict(list)
        for c, a in self.of("single", "range"):
            if c["effects"][0]["sigmas"] < 5.9 or "value" not in a:
                continue
            rightly = self.judged(c, a) in ("right", "class")
            stated = [(v - t) / s for v, t, s in zip(a["value"], c["truth"], a["sigma"])]
            alone = rightly and len(class_of(a["findings"][0])) == 1
            for of, chosen in (("all", True), ("rightly named", rightly), ("rightly named, no other in its class", alone)):
                if chosen:
                    sizes[of, "known before"] += errors(c, a["value_without"])
                    sizes[of, "known"] += errors(c, a["value"])
                    sizes[of, "augmented before"] += augmented_errors(c, a["value_without"])
                    sizes[of, "augmented"] += augmented_errors(c, a["value"])
                    sizes[of, "stated"] += stated
        self.say()
        self.say("error of the 24, 6 sigma and more, rms over (median of the sizes; one normal error: 0.67)")
        for of in ("all", "rightly named", "rightly named, no other in its class"):
            told = {k: f"{rms(v):.2f} ({middle(v):.2f})" for (o, k), v in sizes.items() if o == of}
            if told:
                self.say(f"  {of}: bound with all of the effect's coefficients unknown: before "
                         f"{told['augmented before']}, after {told['augmented']}; with direction and constants known: "
                         f"before {told['known before']}, after {told['known']}; sigma stated: {told['stated']}")

    def rivals(self):
        clean = [a for _, a in self.of("clean") if "rivals" in a]
        strong = [(c, a) for c, a in self.of("single", "range")
                  if c["effects"][0]["sigmas"] >= 5.9 and "rivals" in a]
        outside = [(c, a) for c, a in self.of("outside", "unlike")
                   if c["effects"][0]["sigmas"] >= 5.9 and "rivals" in a]
        self.say()
        self.say("rivals on the same files: false alarms on clean; at 6 sigma and more detected, truth first, truth "
                 "among its names; names outside the catalogue; error of the 24 over the bound")
        self.say(f"  this diagnosis   {share(sum(map(alarmed, clean)), len(clean))}; "
                 f"{share(sum(alarmed(a) for _, a in strong), len(strong))}, "
                 f"{sum(self.judged(c, a) == 'right' for c, a in strong)}, "
                 f"{sum(bool(set(truths(c)) & set().union(*[class_of(f) for f in a['findings']])) for c, a in strong)}; "
                 f"{share(sum(bool(names(a)) for _, a in outside), len(outside))}; "
                 f"{rms([e for c, a in strong for e in errors(c, a['value'])]):.2f}")
        self.say(f"  whiteness, NIS   {share(sum(a['rivals']['whiteness'] for a in clean), len(clean))}; "
                 f"{share(sum(a['rivals']['whiteness'] for _, a in strong), len(strong))}, no names; "
                 f"{rms([e for c, a in strong for e in errors(c, a['value_without'])]):.2f}")
        for key, title in (("bic", "stepwise BIC   "), ("always_on", "all always on  ")):
            first = sum(a["rivals"][key][:1] == [c["effects"][0]["id"]] for c, a in strong)
            among = sum(c["effects"][0]["id"] in a["rivals"][key] for c, a in strong)
            value = "always_on_value" if key == "always_on" else None
            error = f"{rms([e for c, a in strong for e in errors(c, a['rivals'][value])]):.2f}" if value else "-"
            self.say(f"  {title}  {share(sum(bool(a['rivals'][key]) for a in clean), len(clean))}; "
                     f"{share(sum(bool(a['rivals'][key]) for _, a in strong), len(strong))}, {first}, {among}; "
                     f"{share(sum(bool(a['rivals'][key]) for _, a in outside), len(outside))}; {error}")
