#pragma once
#include <array>
#include <string>
#include <vector>

struct ImGuiContext;

namespace innerspring::viewer {

/// What the pointer and the keys do, in points of the window from its upper left.
struct Input {
    double x = -1e9, y = -1e9;
    std::array<bool, 3> buttons{};  ///< left, right, middle: down now, or for a moment since the last frame
    std::array<bool, 3> held{};     ///< down now
    double wheel = 0;               ///< since the last frame
    bool shift = false, control = false;
    std::vector<std::pair<int, bool>> keys;  ///< GLFW key and whether it went down, since the last frame
    std::vector<unsigned> characters;        ///< typed since the last frame
};

/// Dear ImGui with its OpenGL 3 back end, on the context that is current. Input comes from us alone, so that
/// a test moves the same things as a hand.
class Gui {
  public:
    /// `scale`: size of text and widgets against the usual 96 dots per inch.
    explicit Gui(double scale);
    ~Gui();
    Gui(const Gui&) = delete;
    Gui& operator=(const Gui&) = delete;

    /// A frame of width x height points, `pixels` framebuffer pixels to a point.
    void begin(double width, double height, double pixels, double seconds, const Input& input);
    void end();

    double scale() const { return scale_; }
    bool wants_pointer() const;
    bool wants_keys() const;

  private:
    ImGuiContext* context_;
    double scale_;
};

}  // namespace innerspring::viewer
