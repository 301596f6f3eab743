#include "innerspring/study/judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace innerspring {

std::string_view to_string(Outcome outcome) {
    switch (outcome) {
        case Outcome::holds:
            return "holds";
        case Outcome::holds_only_if:
            return "holds only if";
        case Outcome::fails:
            return "fails";
        case Outcome::not_judged:
            return "not judged";
    }
    return "?";
}

namespace {

bool within(const Judged& judged, double threshold) {
    return judged.number <= threshold;  // not a number: not within
}

/// "F/(ER²) up to 0.001, from 0.01": the runs of forces where it holds; `all` is in increasing force.
std::string forces_where_it_holds(const std::vector<Judged>& all, double threshold) {
    if (all.front().group == 0) return within(all.front(), threshold) ? "yes" : "no";
    std::string runs;
    for (std::size_t first = 0, end; first < all.size(); first = end) {
        end = first + 1;
        if (!within(all[first], threshold)) continue;
        while (end < all.size() && within(all[end], threshold)) ++end;
        if (first == 0 && end == all.size()) return "at every force";
        const double low = all[first].group, high = all[end - 1].group;
        runs += runs.empty() ? "F/(ER²) " : ", ";
        runs += first == 0          ? fmt::format("up to {:g}", high)
                : end == all.size() ? fmt::format("from {:g}", low)
                : end - first == 1  ? fmt::format("at {:g}", low)
                                    : fmt::format("from {:g} to {:g}", low, high);
    }
    return runs.empty() ? "at no force" : runs;
}

}  // namespace

void judge(Claim& claim, const std::vector<Judged>& numbers) {
    if (numbers.empty()) {
        claim.outcome = Outcome::not_judged;
        if (claim.condition.empty()) claim.condition = "nothing of it was measured";
        return;
    }
    claim.number = -INFINITY;
    std::size_t good = 0;
    for (const Judged& j : numbers) {
        if (!(j.number <= claim.number)) claim.number = j.number;
        good += within(j, claim.threshold);
    }
    claim.outcome = good == numbers.size() ? Outcome::holds
                    : good == 0            ? Outcome::fails
                                           : Outcome::holds_only_if;
    if (claim.outcome != Outcome::holds_only_if) return;
    std::vector<std::string> places;
    for (const Judged& j : numbers)
        if (std::find(places.begin(), places.end(), j.where) == places.end()) places.push_back(j.where);
    claim.condition.clear();
    for (const std::string& place : places) {
        std::vector<Judged> here;
        for (const Judged& j : numbers)
            if (j.where == place) here.push_back(j);
        if (!claim.condition.empty()) claim.condition += "; ";
        if (!place.empty()) claim.condition += place + ": ";
        claim.condition += forces_where_it_holds(here, claim.threshold);
    }
}

}  // namespace innerspring
