#include "commands.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

namespace {

constexpr std::string_view heading = "innerspring recording 1";
constexpr std::size_t most_places = 1000000;
constexpr std::uint64_t most_ticks = 100000000;

/// The words of a line, one after another.
class Words {
  public:
    explicit Words(std::string_view text) : rest_(text) {}

    std::string_view word(const char* what) {
        while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
        const std::string_view found = rest_.substr(0, rest_.find(' '));
        if (found.empty()) throw InputError(fmt::format("{} is missing", what));
        rest_.remove_prefix(found.size());
        return found;
    }
    double number(const char* what) { return parsed<double>(what); }
    std::uint64_t count(const char* what, int base = 10) {
        const std::string_view text = word(what);
        std::uint64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
        if (error != std::errc() || end != text.data() + text.size())
            throw InputError(fmt::format("{} '{}' is not a count", what, text.substr(0, 40)));
        return value;
    }
    Vector vector(const char* what) {
        Vector v;
        for (int k = 0; k < 3; ++k) v[k] = number(what);
        return v;
    }
    double positive(const char* what) {
        const double value = number(what);
        if (!(value > 0)) throw InputError(fmt::format("{} is {:g}; it must be positive", what, value));
        return value;
    }
    bool done() {
        while (!rest_.empty() && rest_.front() == ' ') rest_.remove_prefix(1);
        return rest_.empty();
    }
    void end() {
        if (!done()) throw InputError(fmt::format("'{}' is too much", rest_.substr(0, 40)));
    }
    std::string_view rest() const { return rest_.empty() ? rest_ : rest_.substr(1); }

  private:
    template <class T>
    T parsed(const char* what) {
        const std::string_view text = word(what);
        T value{};
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value))
            throw InputError(fmt::format("{} '{}' is not a finite number", what, text.substr(0, 40)));
        return value;
    }
    std::string_view rest_;
};

std::string text_of(const Vector& v) {
    return fmt::format("{} {} {}", v.x(), v.y(), v.z());
}

struct ToLine {
    std::string operator()(const Gravity& c) const { return fmt::format("gravity {}", text_of(c.g)); }
    std::string operator()(const Grab& c) const {
        return fmt::format("grab {} {}", text_of(c.near), c.radius);
    }
    std::string operator()(const Drag& c) const { return fmt::format("drag {}", text_of(c.by)); }
    std::string operator()(const Push& c) const {
        return fmt::format("push {} {} {}", text_of(c.near), c.radius, text_of(c.newton));
    }
    std::string operator()(const Touch& c) const {
        return fmt::format("touch {} {} {} {} {}", c.radius, c.length, c.friction, text_of(c.at),
                           text_of(c.axis));
    }
    std::string operator()(const MoveTool& c) const {
        return fmt::format("move {}{}", text_of(c.to),
                           c.turn.isZero(0) ? "" : fmt::format(" {}", text_of(c.turn)));
    }
    std::string operator()(const Release&) const { return "release"; }
    std::string operator()(const Tune& c) const {
        return fmt::format("tune {} {} {} {} {}", c.material.mass, c.material.young, c.material.surface,
                           c.material.damping, c.material.poisson);
    }
    std::string operator()(const SetScheme& c) const { return fmt::format("scheme {}", to_string(c.scheme)); }
    std::string operator()(const RefineNear& c) const {
        return fmt::format("refine {} {}", text_of(c.near), c.radius);
    }
    std::string operator()(const CoarsenNear& c) const {
        return fmt::format("coarsen {} {}", text_of(c.near), c.radius);
    }
    std::string operator()(const PinAt& c) const {
        std::string line = fmt::format("pin {}", c.places.size());
        for (const Vector& place : c.places) line += fmt::format(" {}", text_of(place));
        return line;
    }
    std::string operator()(const Unpin&) const { return "unpin"; }
    std::string operator()(const Reset&) const { return "reset"; }
    std::string operator()(const Undo&) const { return "undo"; }
};

Command parse_words(Words& words) {
    const std::string_view verb = words.word("the command");
    if (verb == "gravity") return Gravity{words.vector("gravity")};
    if (verb == "grab" || verb == "refine" || verb == "coarsen") {
        const Vector near = words.vector("place");
        const double radius = words.positive("radius");
        if (verb == "grab") return Grab{near, radius};
        if (verb == "refine") return RefineNear{near, radius};
        return CoarsenNear{near, radius};
    }
    if (verb == "drag") return Drag{words.vector("way")};
    if (verb == "push") {
        const Vector near = words.vector("place");
        const double radius = words.positive("radius");
        return Push{near, radius, words.vector("force")};
    }
    if (verb == "touch") {
        Touch touch;
        touch.radius = words.positive("radius");
        touch.length = words.number("length"), touch.friction = words.number("friction");
        touch.at = words.vector("place"), touch.axis = words.vector("axis");
        return touch;
    }
    if (verb == "move") {
        MoveTool move{words.vector("place")};
        if (!words.done()) move.turn = words.vector("turn");
        return move;
    }
    if (verb == "release") return Release{};
    if (verb == "tune") {
        Material material;
        material.mass = words.number("mass");
        material.young = words.number("young");
        material.surface = words.number("surface");
        material.damping = words.number("damping");
        material.poisson = words.number("poisson");
        return Tune{material};
    }
    if (verb == "scheme") return SetScheme{parse_scheme(words.word("scheme"))};
    if (verb == "pin") {
        const std::uint64_t count = words.count("number of places");
        if (count > most_places) throw InputError("more places than a pin may have");
        PinAt pin;
        for (std::uint64_t n = 0; n < count; ++n) pin.places.push_back(words.vector("place"));
        return pin;
    }
    if (verb == "unpin") return Unpin{};
    if (verb == "reset") return Reset{};
    if (verb == "undo") return Undo{};
    throw InputError(fmt::format("'{}' is no command", verb.substr(0, 40)));
}

/// The next line of `text`, taken off it.
std::string_view next_line(std::string_view& text) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    return line;
}

}  // namespace

std::string to_line(const Command& command) {
    return std::visit(ToLine{}, command);
}

Command parse_command(std::string_view line) {
    Words words(line);
    Command command = parse_words(words);
    words.end();
    return command;
}

std::string to_text(const Recording& recording) {
    std::string text = fmt::format("{}\nticks {}\nhash {:016x}\ninputs {}\n", heading, recording.ticks,
                                   recording.hash, recording.inputs.size());
    for (const Recording::Input& input : recording.inputs)
        text +=
            fmt::format("{} {}{}\n", input.tick, input.body ? fmt::format("body {} ", *input.body + 1) : "",
                        to_line(input.command));
    for (const Scene& scene : recording.scenes) text += fmt::format("scene\n{}", to_toml(scene));
    return text;
}

bool is_recording(std::string_view text) {
    return text.starts_with(heading) && text.substr(heading.size(), 1) == "\n";
}

Recording recording_from_text(std::string_view text, const std::string& name) {
    if (!is_recording(text)) throw InputError(fmt::format("{}: not a recording of a session", name));
    Recording recording;
    std::size_t number = 0;
    auto line = [&] {
        ++number;
        return next_line(text);
    };
    line();
    try {
        auto field = [&](std::string_view key, int base = 10) {
            Words words(line());
            if (words.word("a line") != key) throw InputError(fmt::format("expected '{}'", key));
            const std::uint64_t value = words.count("its value", base);
            words.end();
            return value;
        };
        recording.ticks = field("ticks");
        if (recording.ticks > most_ticks)
            throw InputError(fmt::format("more than {} steps are too many to play", most_ticks));
        recording.hash = field("hash", 16);
        const std::uint64_t inputs = field("inputs");
        for (std::uint64_t n = 0; n < inputs; ++n) {
            if (text.empty()) throw InputError(fmt::format("{} inputs are missing", inputs - n));
            Words words(line());
            const std::uint64_t tick = words.count("the step");
            if (!recording.inputs.empty() && tick < recording.inputs.back().tick)
                throw InputError(
                    fmt::format("step {} comes after step {}", tick, recording.inputs.back().tick));
            std::optional<std::size_t> body;
            if (words.rest().starts_with("body ")) {
                words.word("body");
                const std::uint64_t which = words.count("the body");
                if (which != 1 && which != 2) throw InputError("expected body 1 or 2");
                body = which - 1;
            }
            recording.inputs.push_back({tick, parse_command(words.rest()), body});
        }
        if (line() != "scene") throw InputError("expected 'scene'");
        if (!recording.inputs.empty() && recording.inputs.back().tick > recording.ticks)
            throw InputError(
                fmt::format("an input at step {} of {}", recording.inputs.back().tick, recording.ticks));
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}:{}: {}", name, number, error.what()));
    }
    constexpr std::string_view between = "\nscene\n";
    while (true) {
        const std::size_t end = text.find(between);
        recording.scenes.push_back(
            scene_from_text(text.substr(0, end == std::string_view::npos ? end : end + 1),
                            fmt::format("{}, scene {}", name, recording.scenes.size() + 1)));
        if (end == std::string_view::npos) break;
        if (recording.scenes.size() == 2) throw InputError(fmt::format("{}: more than two bodies", name));
        text.remove_prefix(end + between.size());
    }
    return recording;
}

}  // namespace innerspring::viewer
