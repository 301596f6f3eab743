// What the keys do in the window.
#include <GLFW/glfw3.h>

#include <algorithm>

#include "window.h"

namespace innerspring::viewer {

void Window::character(unsigned code) {
    input_.characters.push_back(code);
    if (gui_->wants_keys()) return;
    PanelActions actions;
    if (code == '?') panel_.help = !panel_.help;
    if (code == '+') actions.speed = std::min(2 * snapshot().speed, 4.0);
    if (code == '-') actions.speed = std::max(snapshot().speed / 2, 1.0 / 64);
    act(actions);
}

void Window::key(int key, bool down, int modifiers) {
    input_.keys.emplace_back(key, down);
    input_.control = modifiers & GLFW_MOD_CONTROL;
    // Of Shift itself the modifiers say what was before.
    input_.shift =
        key == GLFW_KEY_LEFT_SHIFT || key == GLFW_KEY_RIGHT_SHIFT ? down : modifiers & GLFW_MOD_SHIFT;
    if (!down || gui_->wants_keys()) return;
    Look& look = panel_.look;
    PanelActions actions;
    switch (key) {
        case GLFW_KEY_H:
            panel_.grip = Grip::hold;
            break;
        case GLFW_KEY_P:
            panel_.grip = Grip::push;
            break;
        case GLFW_KEY_B:
            panel_.ball.capsule = panel_.grip == Grip::touch && !panel_.ball.capsule;
            panel_.grip = Grip::touch;
            break;
        case GLFW_KEY_F:
            panel_.grip = Grip::refine;
            break;
        case GLFW_KEY_L:
            panel_.grip = Grip::lasso;
            break;
        case GLFW_KEY_R:
        case GLFW_KEY_C: {
            std::size_t body = 0;
            const auto hit = under_pointer(body);
            if (hit && key == GLFW_KEY_R)
                actions.commands.push_back(RefineNear{rest_place(body, *hit), influence()});
            else if (hit)
                actions.commands.push_back(CoarsenNear{rest_place(body, *hit), influence()});
            else
                say("point at the body to refine or coarsen it");
            break;
        }
        case GLFW_KEY_1:
            actions.commands.push_back(SetScheme{Scheme::A});
            break;
        case GLFW_KEY_2:
            actions.commands.push_back(SetScheme{Scheme::B});
            break;
        case GLFW_KEY_3:
            actions.commands.push_back(SetScheme{Scheme::C});
            break;
        case GLFW_KEY_X:
            if (const std::size_t count = snapshot().bodies.size(); count > 1) {
                const std::size_t next = panel_.body ? *panel_.body + 1 : 0;
                panel_.body = next < count ? std::optional(next) : std::nullopt;
                say(!panel_.body ? "scheme and sliders: both bodies"
                    : next == 0  ? "scheme and sliders: the left body"
                                 : "scheme and sliders: the right body");
            }
            break;
        case GLFW_KEY_G: {
            if (input_.shift) {
                actions.down = true;
                break;
            }
            const bool on = !snapshot().gravity.isZero(0);
            actions.commands.push_back(Gravity{on ? Vector(Vector::Zero()) : panel_.gravity});
            break;
        }
        case GLFW_KEY_SPACE:
            if (playback_) playing_ = !playing_;
            actions.pause = !snapshot().paused;
            break;
        case GLFW_KEY_PERIOD:
            actions.step = true;
            break;
        case GLFW_KEY_BACKSPACE:
            actions.commands.push_back(Reset{});
            break;
        case GLFW_KEY_Z:
            actions.commands.push_back(Undo{});
            break;
        case GLFW_KEY_V:
            look.colour = all_colours[(std::size_t(look.colour) + 1) % std::size(all_colours)];
            break;
        case GLFW_KEY_W:
            look.wireframe = !look.wireframe;
            break;
        case GLFW_KEY_S:
            look.flat = !look.flat;
            break;
        case GLFW_KEY_O:
            look.homes = !look.homes;
            break;
        case GLFW_KEY_T:
            look.tetrahedra = !look.tetrahedra;
            break;
        case GLFW_KEY_Y:
            look.fibres = !look.fibres;
            break;
        case GLFW_KEY_0:
            actions.fit = true;
            break;
        case GLFW_KEY_F2:
            actions.picture = true;
            break;
        case GLFW_KEY_F3:
            actions.vtp = true;
            break;
        case GLFW_KEY_F4:
            actions.scene = true;
            break;
        case GLFW_KEY_F5:
            actions.recording = true;
            break;
        case GLFW_KEY_F6:
            actions.replay = true;
            break;
        case GLFW_KEY_TAB:
            panel_.open = !panel_.open;
            break;
        case GLFW_KEY_Q:
            close();
            break;
        default:
            break;
    }
    act(actions);
}

}  // namespace innerspring::viewer
