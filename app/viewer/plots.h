#pragma once
#include <deque>
#include <string>

#include "snapshot.h"

namespace innerspring::viewer {

/// What the live plots show, one sample a snapshot.
class History {
  public:
    struct Sample {
        double time;                                            ///< [s]
        std::vector<double> volume_percent, force, tool_force;  ///< per body: [%], [N], [N]
        double step_ms, energy;  ///< energy [J]: kinetic and elastic, of the first body
    };
    void add(const Snapshot& snapshot);
    void clear() { samples_.clear(); }
    const std::deque<Sample>& samples() const { return samples_; }

  private:
    std::deque<Sample> samples_;
};

/// The curves over time, with their latest values; between Gui::begin and end, inside a window.
void draw_plots(const History& history, const Snapshot& snapshot, double scale);

}  // namespace innerspring::viewer
