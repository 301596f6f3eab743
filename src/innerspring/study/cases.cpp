#include "innerspring/study/cases.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <numeric>
#include <set>

#include "innerspring/mesh/team.h"

namespace innerspring {

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Cases yet to be run: a place for each response, and a flag that says when it can be read.
struct Pending {
    const Case* what;
    double cost;
    Response response;
    std::atomic<bool> done{false};
};

/// Something that one thread at a time does now and then; the others pass by.
class Now {
  public:
    explicit Now(double every_s) : every_(every_s) {}
    template <class Action>
    void and_then(Action&& action) {
        if (busy_.test_and_set(std::memory_order_acquire)) return;
        if (seconds_since(last_) > every_) {
            action();
            last_ = Clock::now();
        }
        busy_.clear(std::memory_order_release);
    }

  private:
    double every_;
    Clock::time_point last_ = Clock::now();
    std::atomic_flag busy_ = ATOMIC_FLAG_INIT;
};

class Runner {
  public:
    Runner(const std::vector<Job>& jobs, const CasesOptions& options, Responses& responses)
        : options_(options), responses_(responses), before_(responses.size()), stop_(options.stop) {
        std::set<std::string_view> keys;
        std::size_t count = 0;
        for (const Job& job : jobs) count += job.cases.size();
        pending_ = std::vector<Pending>(count);
        std::size_t used = 0;
        for (const Job& job : jobs) {
            Work work{&job, used, used, {}};
            for (const Case& c : job.cases)
                if (!responses.contains(c.key) && keys.insert(c.key).second) {
                    pending_[used].what = &c;
                    pending_[used++].cost = job.cost;
                }
            work.last = used;
            if (work.last > work.first) work_.push_back(std::move(work));
        }
        used_ = used;
        for (std::size_t n = 0; n < used_; ++n) total_ += pending_[n].cost;
        // Longest first: no long job is left to one thread at the end.
        std::stable_sort(work_.begin(), work_.end(),
                         [](const Work& a, const Work& b) { return a.cost() > b.cost(); });
    }

    bool run() {
        Team team(options_.threads);
        // Each block takes work as it becomes free; what a job finds does not depend on who runs it.
        team.run(std::size_t(team.threads()), [&](std::size_t) {
            for (std::size_t n; (n = next_.fetch_add(1)) < work_.size() && !stopped();) {
                try {
                    run(work_[n]);
                } catch (...) {
                    work_[n].failure = std::current_exception();
                }
            }
        });
        keep();
        if (!options_.file.empty()) write_cases(responses_, options_.hash, options_.file);
        for (const Work& work : work_)
            if (work.failure) std::rethrow_exception(work.failure);
        return responses_.size() == before_ + used_;
    }

  private:
    struct Work {
        const Job* job;
        std::size_t first, last;  ///< of pending_
        std::exception_ptr failure;
        double cost() const { return job->cost * double(last - first); }
    };

    bool stopped() const { return stop_ && stop_->load(); }

    void run(const Work& work) {
        const std::shared_ptr<const Body> body = work.job->body();
        StepOptions step;
        step.dt = options_.sampling.dt_s;
        step.integrator = Integrator::symplectic;
        step.precision = Precision::full;
        Workspace workspace(*body, step);
        State state;
        for (std::size_t n = work.first; n < work.last && !stopped(); ++n) {
            Pending& p = pending_[n];
            p.response = p.what->solve ? p.what->solve(*body)
                                       : respond(*body, p.what->loads(*body), p.what->watched,
                                                 options_.sampling, workspace, state);
            p.done.store(true, std::memory_order_release);
            show_.and_then([&] { progress(); });
            save_.and_then([&] {
                keep();
                if (!options_.file.empty()) write_cases(responses_, options_.hash, options_.file);
            });
        }
    }

    /// Moves what is done to the responses. Never by two threads at once.
    void keep() {
        for (std::size_t n = 0; n < used_; ++n)
            if (pending_[n].done.load(std::memory_order_acquire))
                responses_.try_emplace(pending_[n].what->key, pending_[n].response);
    }

    void progress() const {
        if (!options_.progress) return;
        double done = 0;
        std::size_t count = before_;
        for (std::size_t n = 0; n < used_; ++n)
            if (pending_[n].done.load(std::memory_order_relaxed)) done += pending_[n].cost, ++count;
        const double share = done / total_;
        options_.progress({share, seconds_since(begin_) * (1 - share) / share, count, before_ + used_});
    }

    const CasesOptions& options_;
    Responses& responses_;
    std::size_t before_, used_ = 0;
    const std::atomic<bool>* stop_;
    std::vector<Pending> pending_;
    std::vector<Work> work_;
    double total_ = 0;
    std::atomic<std::size_t> next_{0};
    Clock::time_point begin_ = Clock::now();
    Now show_{0.1}, save_{2};
};

}  // namespace

bool run_cases(const std::vector<Job>& jobs, const CasesOptions& options, Responses& responses) {
    return Runner(jobs, options, responses).run();
}

}  // namespace innerspring
