#include "window.h"

#include <GLFW/glfw3.h>
#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "feeling.h"
#include "innerspring/mesh/error.h"
#include "innerspring/mesh/write.h"
#include "innerspring/record/vtk.h"

namespace innerspring::viewer {

namespace {

Window& self(GLFWwindow* window) {
    return *static_cast<Window*>(glfwGetWindowUserPointer(window));
}

void connect(GLFWwindow* window) {
    glfwSetCursorPosCallback(window, [](GLFWwindow* w, double x, double y) { self(w).mouse_move(x, y); });
    glfwSetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int modifiers) {
        self(w).mouse_button(button, action == GLFW_PRESS, modifiers);
    });
    glfwSetScrollCallback(window, [](GLFWwindow* w, double, double up) { self(w).scroll(up); });
    glfwSetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int modifiers) {
        if (action != GLFW_REPEAT) self(w).key(key, action == GLFW_PRESS, modifiers);
    });
    glfwSetCharCallback(window, [](GLFWwindow* w, unsigned code) { self(w).character(code); });
    glfwSetDropCallback(window, [](GLFWwindow* w, int count, const char** paths) {
        self(w).drop(std::vector<std::string>(paths, paths + count));
    });
}

/// Whether a window's corner there can be seen and taken hold of.
bool on_a_monitor(int x, int y) {
    int count = 0;
    GLFWmonitor** monitors = glfwGetMonitors(&count);
    for (int n = 0; n < count; ++n) {
        int left = 0, top = 0, width = 0, height = 0;
        glfwGetMonitorWorkarea(monitors[n], &left, &top, &width, &height);
        if (x >= left && y >= top && x < left + width - 100 && y < top + height - 100) return true;
    }
    return false;
}

}  // namespace

Window::Window(const WindowOptions& options) : options_(options) {
    panel_.look = options.look;
    panel_.ball = options.ball;
    Remembered remembered;
    if (const auto file = remembered_file(); options.remember && file) remembered = recall(*file);
    if (options.size) remembered.width = (*options.size)[0], remembered.height = (*options.size)[1];
    panel_.open = remembered.panel;
    camera_.azimuth = remembered.azimuth, camera_.elevation = remembered.elevation;
    remembered_zoom_ = remembered.zoom;
    show(options.feeling
             ? Opened{}
             : load(options.open));  // before there is a window: what cannot be opened is said at once

    if (!glfwInit()) throw RunError(no_graphics("no display"));
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_SCALE_TO_MONITOR, GLFW_TRUE);
    glfwWindowHint(GLFW_SAMPLES, 4);
    const auto make = [&] {
        window_ = glfwCreateWindow(remembered.width, remembered.height, "innerspring", nullptr, nullptr);
        if (window_) glfwMakeContextCurrent(window_);
    };
    make();
    if (window_ && drawn_by_software()) {  // where 4 samples a pixel cost more than all the rest
        glfwDestroyWindow(window_);
        glfwWindowHint(GLFW_SAMPLES, 0);
        make();
    }
    if (!window_) {
        const char* words = nullptr;
        glfwGetError(&words);
        const std::string why = words ? words : "no window";
        glfwTerminate();
        throw RunError(no_graphics(why));
    }
    if (remembered.x && remembered.y && on_a_monitor(*remembered.x, *remembered.y))
        glfwSetWindowPos(window_, *remembered.x, *remembered.y);
    glfwSwapInterval(1);
    glfwSetWindowUserPointer(window_, this);
    connect(window_);
    update_size();
    gui_ = std::make_unique<Gui>(scale_);
    stage_ = std::make_unique<Stage>();
    last_frame_ = glfwGetTime();
    if (!options_.feeling) say(std::string(hint), 20);
}

Window::~Window() {
    if (options_.remember) try {
            Remembered now;
            now.width = int(width_), now.height = int(height_);
            now.azimuth = camera_.azimuth, now.elevation = camera_.elevation, now.zoom = zoomed(camera_);
            now.panel = panel_.open;
            int x = 0, y = 0;
            glfwGetError(nullptr);  // of before
            glfwGetWindowPos(window_, &x, &y);
            if (glfwGetError(nullptr) == GLFW_NO_ERROR) now.x = x, now.y = y;  // Wayland tells nobody
            if (const auto file = remembered_file()) remember(now, *file);
        } catch (const std::exception&) {  // a window that cannot be remembered closes all the same
        }
    session_.reset();
    stage_.reset();
    gui_.reset();
    glfwDestroyWindow(window_);
    glfwTerminate();
}

Window::Opened Window::load(const OpenRequest& request) {
    if (request.what.size() == 1 && Playback::is_one(request.what[0]))
        return {nullptr, std::make_unique<Playback>(request.what[0])};
    return {open_rig(request), nullptr};
}

void Window::show(Opened opened) {
    std::unique_ptr<Session> session;
    if (opened.rig) {
        session = std::make_unique<Session>(std::move(opened.rig));
        session->update();
    }
    playback_ = std::move(opened.playback);
    session_ = std::move(session);
    history_.clear();
    gesture_ = {};
    said_ = 0;
    play_time_ = 0;
    panel_.body.reset();
    panel_.before_slider.reset();
    if (options_.feeling && options_.feeling->has_mouse()) pointed_ = options_.feeling->mouse_start();
    if (!snapshot().gravity.isZero(0)) set_gravity(panel_, snapshot().gravity);
    if (!opened.again) fit(camera_, snapshot());
    if (options_.camera) {
        camera_.azimuth = options_.camera->azimuth, camera_.elevation = options_.camera->elevation;
        zoom(camera_, options_.camera->zoom);
        options_.camera.reset();  // for the first body only
    } else if (remembered_zoom_ != 1) {
        zoom(camera_, remembered_zoom_);
    }
    remembered_zoom_ = 1;  // as above
}

void Window::open(const OpenRequest& request) {
    if (options_.feeling) return say("this body is in the hand; close the window to open another");
    if (opening_.valid()) return say(fmt::format("{} is still being opened", opening_what_));
    opening_what_ = request.what.empty() ? "" : request.what[0];
    opening_ = std::async(std::launch::async, [request] { return load(request); });
}

void Window::replay_session() {
    if (opening_.valid()) return say(fmt::format("{} is still being opened", opening_what_));
    opening_what_ = "the session from its beginning";
    // Written down between two steps in the session's thread, set up beside it, then shown in its place.
    const auto written = std::make_shared<std::promise<Recording>>();
    session_->ask([written](const Rig& rig) {
        written->set_value(rig.recording());
        return std::string();
    });
    opening_ = std::async(std::launch::async, [recording = written->get_future().share()] {
        return Opened{std::make_unique<Rig>(recording.get()), nullptr, true};
    });
}

void Window::finish_opening() {
    if (!opening_.valid() || opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
    try {
        show(opening_.get());
        say(snapshot().replaying ? "replaying what was done"
                                 : fmt::format("{}: {} vertices", snapshot().bodies[0].surface->name,
                                               snapshot().bodies[0].u.size()));
        if (playback_ && !playback_->note().empty()) say(playback_->note());
    } catch (const std::exception& error) {
        say(error.what());
    }
}

const Snapshot& Window::snapshot() const {
    if (options_.feeling) return options_.feeling->latest();
    return session_ ? session_->latest() : playback_->snapshot();
}

void Window::say(std::string message, double seconds) {
    message_ = std::move(message);
    message_until_ = glfwGetTime() + seconds;
}

void Window::update_size() {
    int w = 1, h = 1, fw = 1, fh = 1;
    float sx = 1, sy = 1;
    glfwGetWindowSize(window_, &w, &h);
    glfwGetFramebufferSize(window_, &fw, &fh);
    glfwGetWindowContentScale(window_, &sx, &sy);
    width_ = std::max(1, w), height_ = std::max(1, h);
    pixels_ = std::max(1, fw) / width_;
    // Where points are pixels already (X11), text must grow with the density; where they are not (macOS), it
    // does.
    scale_ = std::max(1.0, double(sx) / pixels_);
}

Box2 Window::stage_box() const {
    return {0, 0, panel_.open && panel_fits() ? width_ - panel_width(scale_) : width_, height_};
}
bool Window::panel_fits() const {
    return panel_width(scale_) < 0.7 * width_;
}
Box2 Window::panel_box() const {
    const double side = panel_width(scale_);
    return {width_ - side, 0, side, height_};
}

bool Window::frame() {
    glfwPollEvents();
    update_size();
    const double now = glfwGetTime(), seconds = now - last_frame_;
    last_frame_ = now;
    finish_opening();
    if (session_ && session_->update()) {
        history_.add(snapshot());
        if (snapshot().said != said_) {
            said_ = snapshot().said;
            if (!snapshot().message.empty()) say(snapshot().message);
        }
    }
    if (Feeling* feeling = options_.feeling) {
        if (feeling->update()) history_.add(snapshot());
        if (feeling->ended()) close();
        move_mouse();
    }
    move_tool();

    const Box2 box = stage_box();
    make_room(camera_, snapshot(), panel_.look.colour, box, scale_);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    gui_->begin(width_, height_, pixels_, seconds, input_);
    input_.wheel = 0;
    input_.keys.clear(), input_.characters.clear();
    for (std::size_t n = 0; n < 3; ++n) input_.buttons[n] = input_.held[n];
    stage_->draw(snapshot(), panel_.look, camera_, box, height_, pixels_, scale_, seconds);
    const PanelActions actions = draw_panel(snapshot(), history_, panel_, panel_box(), panel_fits(), scale_);
    if (playback_) draw_transport(box, seconds);
    draw_message(box);
    gui_->end();
    if (keep_picture_ || save_picture_) {
        glReadBuffer(GL_BACK);
        picture_ = read_pixels(int(std::lround(width_ * pixels_)), int(std::lround(height_ * pixels_)));
        if (save_picture_) save_picture();
        keep_picture_ = save_picture_ = false;
    }
    glfwSwapBuffers(window_);
    act(actions);
    return !closing_ && !glfwWindowShouldClose(window_);
}

const Image& Window::keep_picture() {
    keep_picture_ = true;
    frame();
    return picture_;
}

void Window::draw_message(const Box2& box) {
    if (gesture_.kind == Gesture::Kind::lasso && gesture_.outline.size() > 1) {
        std::vector<ImVec2> line;
        for (const auto& [x, y] : gesture_.outline) line.push_back({float(x), float(y)});
        ImGui::GetForegroundDrawList()->AddPolyline(line.data(), int(line.size()), IM_COL32(200, 40, 20, 255),
                                                    ImDrawFlags_Closed, float(1.5 * scale_));
    }
    const bool opening = opening_.valid();
    if (!opening && (message_.empty() || glfwGetTime() > message_until_)) return;
    const std::string words = opening ? fmt::format("opening {} ...", opening_what_) : message_;
    ImGui::SetNextWindowPos({float(box.x + box.width / 2), float(box.height - 44 * scale_)}, ImGuiCond_Always,
                            {0.5f, 1});
    ImGui::SetNextWindowSizeConstraints({0, 0}, {float(0.8 * box.width), 1e4f});
    ImGui::Begin("message", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize |
                     ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoFocusOnAppearing);
    ImGui::PushTextWrapPos(float(0.75 * box.width));
    ImGui::TextUnformatted(words.c_str());
    ImGui::PopTextWrapPos();
    ImGui::End();
}

void Window::draw_transport(const Box2& box, double seconds) {
    ImGui::SetNextWindowPos({float(box.width / 2), float(box.height - 12 * scale_)}, ImGuiCond_Always,
                            {0.5f, 1});
    ImGui::SetNextWindowSize({float(0.6 * box.width), 0});
    ImGui::Begin("frames", nullptr, ImGuiWindowFlags_NoDecoration);
    if (ImGui::Button(playing_ ? "pause" : "play")) playing_ = !playing_;
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1);
    float time = float(play_time_);
    if (ImGui::SliderFloat("##time", &time, 0, float(playback_->end()), "%.3f s")) play_time_ = time;
    ImGui::End();
    if (playing_) play_time_ += seconds;
    if (play_time_ > playback_->end() + 0.7) play_time_ = 0;  // the last one stays a while
    try {
        playback_->show_time(play_time_);
        history_.add(snapshot());
    } catch (const InputError& error) {
        playing_ = false;
        play_time_ = 0;
        say(error.what());
    }
}

void Window::act(const PanelActions& actions) {
    if (actions.fit) fit(camera_, snapshot());
    if (actions.picture) save_picture_ = true;
    if (actions.step && playback_) {
        playing_ = false;
        play_time_ = playback_->time_of((playback_->at() + 1) % playback_->frames());
    }
    if (actions.vtp && playback_) say("this is a frame of a file already");
    if (options_.feeling && (actions.vtp || actions.scene || actions.recording))
        say("of a body in the hand, pictures only; --record writes what the hand does");
    if (!session_) return;
    if (actions.down) {
        set_gravity(panel_, -panel_.gravity.norm() * camera_.up());
        session_->send(Gravity{panel_.gravity});
    }
    if (actions.replay) replay_session();
    for (const Command& command : actions.commands) {
        const bool own = std::holds_alternative<SetScheme>(command) || std::holds_alternative<Tune>(command);
        session_->send(command, own ? panel_.body : std::nullopt);
    }
    if (actions.pause) session_->pause(*actions.pause);
    if (actions.step) session_->pause(true), session_->single_step();
    if (actions.speed) session_->set_speed(*actions.speed);
    const std::size_t which = panel_.body.value_or(0);
    if (actions.vtp)
        save("vtp", [which](const Rig& rig) {
            const Simulation& s = rig[which];
            std::vector<Vector> u(s.state().x.size());
            for (std::size_t i = 0; i < u.size(); ++i) u[i] = s.state().x[i] - s.body().rest.positions[i];
            const VertexField fields[] = {{"displacement_m", std::span<const Vector>(u)},
                                          {"velocity_m_s", std::span<const Vector>(s.state().v)},
                                          {"m_kg", std::span<const double>(s.body().m)},
                                          {"K_n_m", std::span<const double>(s.body().K)}};
            return to_vtp(s.state().x, s.body().rest.triangles, fields);
        });
    if (actions.scene) save("toml", [which](const Rig& rig) { return to_toml(rig[which].scene()); });
    if (actions.recording) save("session", [](const Rig& rig) { return to_text(rig.recording()); });
}

std::filesystem::path Window::free_name(const char* extension) const {
    for (int n = 1;; ++n) {
        const auto file = options_.save / fmt::format("innerspring-{}.{}", n, extension);
        std::error_code ignored;
        if (!std::filesystem::exists(file, ignored)) return file;
    }
}

void Window::save(const char* extension, std::function<std::string(const Rig&)> text) {
    session_->ask([file = free_name(extension), text = std::move(text)](const Rig& rig) {
        write_whole(file, text(rig));
        return fmt::format("saved {}", file.string());
    });
}

void Window::save_picture() {
    try {
        const auto file = free_name("png");
        write_whole(file, to_png(picture_));
        say(fmt::format("saved {}", file.string()));
    } catch (const std::exception& error) {
        say(error.what());
    }
}

void run_window(const WindowOptions& options) {
    Window window(options);
    double due = glfwGetTime();
    while (window.frame()) {
        // Where swapping does not wait for the screen, 60 frames a second are enough.
        due = std::max(due + 1.0 / 60, glfwGetTime() - 1.0 / 60);
        if (const double left = due - glfwGetTime(); left > 1e-3) glfwWaitEventsTimeout(left);
    }
}

}  // namespace innerspring::viewer
