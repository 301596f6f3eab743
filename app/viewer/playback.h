#pragma once
#include <filesystem>

#include "snapshot.h"

namespace innerspring::viewer {

/// The frames that `simulate` wrote, played back: the folder, or its frames.pvd.
class Playback {
  public:
    static bool is_one(const std::filesystem::path& path);
    /// Throws InputError.
    explicit Playback(const std::filesystem::path& path);

    std::size_t frames() const { return frames_.size(); }
    std::size_t at() const { return at_; }
    double end() const { return frames_.back().time; }
    double time_of(std::size_t frame) const { return frames_[frame].time; }
    /// Reads a frame. Throws InputError if it is damaged.
    void show(std::size_t frame);
    /// The frame of a time [s].
    void show_time(double time);
    const Snapshot& snapshot() const { return snapshot_; }
    /// Why tools are not shown; empty if all is well.
    const std::string& note() const { return note_; }

  private:
    struct Known {
        double time;
        std::filesystem::path file;
    };
    std::vector<Known> frames_;
    std::vector<Tool> tools_;  ///< of the scene beside the frames
    std::string note_;
    std::size_t at_ = 0;
    Snapshot snapshot_;
};

}  // namespace innerspring::viewer
