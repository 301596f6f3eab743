#pragma once
#include <array>
#include <future>
#include <memory>

#include "gui.h"
#include "open.h"
#include "panel.h"
#include "playback.h"
#include "remembered.h"
#include "session.h"
#include "stage.h"

struct GLFWwindow;

namespace innerspring::viewer {

class Feeling;

struct WindowOptions {
    OpenRequest open;
    Feeling* feeling = nullptr;              ///< shown instead, for as long as it lasts; outlives the window
    std::optional<std::array<int, 2>> size;  ///< [point]; else as remembered
    std::optional<CameraOption> camera;      ///< else as remembered
    Look look;
    Ball ball;
    bool remember = true;              ///< window and camera, from session to session
    std::filesystem::path save = ".";  ///< folder for what is saved
};

/// The window: shows what a session or a recorded simulation says and turns what the user does into commands.
/// GLFW calls the event functions below; so do the tests.
class Window {
  public:
    /// Throws RunError without a display or OpenGL 3.3, InputError for what cannot be opened.
    explicit Window(const WindowOptions& options);
    ~Window();
    Window(const Window&) = delete;
    Window& operator=(const Window&) = delete;

    /// Handles what has come in and draws. False once it is to close.
    bool frame();

    // Events; places in points from the upper left.
    void mouse_move(double x, double y);
    void mouse_button(int button, bool down, int modifiers);
    void scroll(double up);
    void key(int key, bool down, int modifiers);
    void character(unsigned code);
    void drop(const std::vector<std::string>& files);
    void close() { closing_ = true; }

    /// Opens something else in a thread and shows it when it is there; if it cannot be opened, says why and
    /// goes on.
    void open(const OpenRequest& request);

    const Snapshot& snapshot() const;
    Session* session() {
        return session_.get();
    }  ///< null for a recorded simulation, and for one that is felt
    const std::string& message() const { return message_; }
    const Camera& camera() const { return camera_; }
    const PanelState& panel() const { return panel_; }
    GLFWwindow* handle() { return window_; }
    /// Where a point of the first body is seen [point].
    std::array<double, 2> on_screen(const Vector& place) const;
    /// What the last frame showed.
    const Image& keep_picture();

    /// What is said at first.
    static constexpr std::string_view hint =
        "drag the body to hold it, beside it to turn; wheel: nearer; ?: all keys; files may be dropped here";

  private:
    struct Gesture {
        enum class Kind { none, orbit, pan, hold, push, touch, lasso } kind = Kind::none;
        int button = 0;
        std::size_t body = 0;
        bool moved = false;                          ///< since the tool was last brought along
        Vector taken = Vector::Zero();               ///< hold, touch: the point of the surface taken [m]
        Vector tool = Vector::Zero();                ///< touch: the tool's middle at first [m]
        Vector into = Vector::Zero();                ///< touch: where its depth goes, length 1
        double depth = 0;                            ///< touch: by the wheel [m]
        double turn = 0;                             ///< touch: about `into` [radian]
        std::vector<std::array<double, 2>> outline;  ///< lasso
    };
    struct Opened {
        std::unique_ptr<Rig> rig;
        std::unique_ptr<Playback> playback;
        bool again = false;  ///< the bodies shown already: the camera stays
    };
    static Opened load(const OpenRequest& request);
    void show(Opened opened);
    void finish_opening();
    void replay_session();
    void update_size();
    Box2 stage_box() const;
    bool panel_fits() const;
    Box2 panel_box() const;
    void begin_tool();
    void begin_touch(const Hit& hit);
    Vector pointer_way() const;
    Vector beside(const Vector& point) const;
    void move_mouse();
    void move_tool();
    void end_lasso();
    std::optional<Hit> under_pointer(std::size_t& body) const;
    Vector rest_place(std::size_t body, const Hit& hit) const;
    void act(const PanelActions& actions);
    void save_picture();
    void save(const char* extension, std::function<std::string(const Rig&)> text);
    std::filesystem::path free_name(const char* extension) const;
    void say(std::string message, double seconds = 8);
    void draw_message(const Box2& box);
    void draw_transport(const Box2& box, double seconds);
    double influence() const;

    WindowOptions options_;
    GLFWwindow* window_ = nullptr;
    double width_ = 1, height_ = 1, pixels_ = 1, scale_ = 1;
    std::unique_ptr<Gui> gui_;
    std::unique_ptr<Stage> stage_;
    std::unique_ptr<Session> session_;
    std::unique_ptr<Playback> playback_;
    Camera camera_;
    PanelState panel_;
    History history_;
    Input input_;
    Gesture gesture_;
    Vector pointed_ = Vector::Zero();  ///< where a haptic mouse is [m]
    std::future<Opened> opening_;
    std::string opening_what_, message_;
    double message_until_ = 0;
    std::uint64_t said_ = 0;
    double last_frame_ = 0;
    double remembered_zoom_ = 1;
    bool playing_ = true;   ///< a recorded simulation
    double play_time_ = 0;  ///< [s]
    bool closing_ = false, save_picture_ = false, keep_picture_ = false;
    Image picture_;
};

/// Opens a window and stays until it is closed.
void run_window(const WindowOptions& options);

}  // namespace innerspring::viewer
