#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "innerspring/study/response.h"

namespace innerspring {

/// One simulation: loads on a body, and the vertex whose displacement is followed.
struct Case {
    std::string key;  ///< one line, unique within a study
    std::function<Loads(const Body&)> loads;
    Index watched = no_index;
    std::function<Response(const Body&)> solve = {};  ///< what is done instead of a simulation, if given
};

/// Cases on the same body, which is made when its turn comes and given back after.
struct Job {
    std::function<std::shared_ptr<const Body>()> body;
    double cost = 1;  ///< of a case, estimated, in any unit: the longest go first
    std::vector<Case> cases;
};

using Responses = std::map<std::string, Response>;  ///< by Case::key

struct StudyProgress {
    double share;  ///< of the work, 0 .. 1
    double seconds_left;
    std::size_t done, cases;
};

struct CasesOptions {
    Sampling sampling;
    int threads = 0;             ///< 0: all cores; the responses are the same bits
    std::filesystem::path file;  ///< where finished cases are kept
    std::uint64_t hash = 0;      ///< of all that the cases depend on
    std::function<void(const StudyProgress&)> progress = {};  ///< called about ten times a second
    const std::atomic<bool>* stop = nullptr;  ///< true: finish the running cases, save, return
};

/// Simulates every case that `responses` does not have yet and adds it there; cases of the same key are run
/// once. The file is written whole about every two seconds and at the end. Returns false if stopped before
/// the last one. Throws what a job threw (the first, in order), after saving.
bool run_cases(const std::vector<Job>& jobs, const CasesOptions& options, Responses& responses);

using SeriesTable = std::map<std::string, std::vector<std::vector<double>>>;  ///< by a key of one line

/// As text, numbers to the last bit, with a checksum. `what` says whose they are, in the first line.
void write_table(const SeriesTable& table, std::string_view what, std::uint64_t hash,
                 const std::filesystem::path& file);

/// Throws InputError if the file is missing, damaged, or of another study (another hash).
SeriesTable read_table(std::string_view what, std::uint64_t hash, const std::filesystem::path& file);

/// The finished cases as such a table.
void write_cases(const Responses& responses, std::uint64_t hash, const std::filesystem::path& file);

Responses read_cases(const std::filesystem::path& file, std::uint64_t hash);

}  // namespace innerspring
