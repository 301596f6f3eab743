#include "innerspring/mesh/nearest_name.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace innerspring {

namespace {

char lower(char c) {
    return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
}

bool same(char p, char q) {
    return lower(p) == lower(q) || ((p == '-' || p == '_') && (q == '-' || q == '_'));
}

/// Optimal string alignment: insert, delete, replace, or swap two neighbours, each costs one. Letter case is
/// ignored.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> before_last, last(b.size() + 1), row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        before_last = std::exchange(last, row);
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            row[j] =
                std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (same(a[i - 1], b[j - 1]) ? 0 : 1)});
            if (i > 1 && j > 1 && same(a[i - 1], b[j - 2]) && same(a[i - 2], b[j - 1]))
                row[j] = std::min(row[j], before_last[j - 2] + 1);
        }
    }
    return row[b.size()];
}

bool starts_with(std::string_view word, std::string_view start) {
    return word.size() >= start.size() && std::equal(start.begin(), start.end(), word.begin(), same);
}

}  // namespace

std::string nearest_name(std::string_view word, std::span<const std::string_view> candidates) {
    constexpr std::size_t longest = 64;  // no name is longer, and a hostile word must not cost quadratic time
    if (word.empty() || word.size() > longest) return {};
    std::string_view best;
    std::size_t best_distance = 0;
    for (std::string_view candidate : candidates) {
        // A beginning is meant as an abbreviation ("irreg"), however much is missing.
        const std::size_t distance =
            word.size() >= 3 && starts_with(candidate, word) ? 1 : edit_distance(word, candidate);
        const std::size_t allowed = std::max<std::size_t>(1, std::max(word.size(), candidate.size()) / 3);
        if (distance <= allowed && distance < candidate.size() &&
            (best.empty() || distance < best_distance)) {
            best = candidate;
            best_distance = distance;
        }
    }
    return std::string(best);
}

}  // namespace innerspring
