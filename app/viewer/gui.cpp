#include "gui.h"

#include <GLFW/glfw3.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "innerspring/mesh/error.h"

namespace innerspring::viewer {

Gui::Gui(double scale) : scale_(std::clamp(scale, 0.5, 4.0)) {
    IMGUI_CHECKVERSION();
    context_ = ImGui::CreateContext();
    ImGui::SetCurrentContext(context_);  // also where there is another
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.BackendFlags |= ImGuiBackendFlags_HasMouseCursors;
    const std::pair<int, int> keys[] = {{ImGuiKey_Tab, GLFW_KEY_TAB},
                                        {ImGuiKey_LeftArrow, GLFW_KEY_LEFT},
                                        {ImGuiKey_RightArrow, GLFW_KEY_RIGHT},
                                        {ImGuiKey_Home, GLFW_KEY_HOME},
                                        {ImGuiKey_End, GLFW_KEY_END},
                                        {ImGuiKey_Delete, GLFW_KEY_DELETE},
                                        {ImGuiKey_Backspace, GLFW_KEY_BACKSPACE},
                                        {ImGuiKey_Enter, GLFW_KEY_ENTER},
                                        {ImGuiKey_Escape, GLFW_KEY_ESCAPE},
                                        {ImGuiKey_A, GLFW_KEY_A}};
    for (const auto& [theirs, ours] : keys) io.KeyMap[theirs] = ours;
    ImFontConfig font;
    font.SizePixels = float(13 * scale_);
    io.Fonts->AddFontDefault(&font);
    ImGui::StyleColorsLight();
    ImGui::GetStyle().ScaleAllSizes(float(scale_));
    ImGui::GetStyle().WindowRounding = 0;
    ImGui::GetStyle().Colors[ImGuiCol_WindowBg] = ImVec4(0.98f, 0.98f, 0.98f, 1);
    ImGui::GetStyle().Colors[ImGuiCol_FrameBg] = ImVec4(0.88f, 0.90f, 0.93f, 1);
    ImGui::GetStyle().ItemSpacing.y = float(std::round(3 * scale_));
    if (!ImGui_ImplOpenGL3_Init("#version 330 core")) {
        ImGui::DestroyContext(context_);
        throw RunError("the user interface cannot be drawn with this OpenGL");
    }
}

Gui::~Gui() {
    ImGui::SetCurrentContext(context_);
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext(context_);
}

void Gui::begin(double width, double height, double pixels, double seconds, const Input& input) {
    ImGui::SetCurrentContext(context_);
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = {float(width), float(height)};
    io.DisplayFramebufferScale = {float(pixels), float(pixels)};
    io.DeltaTime = float(std::clamp(seconds, 1e-4, 1.0));
    io.MousePos = {float(input.x), float(input.y)};
    for (int n = 0; n < 3; ++n) io.MouseDown[n] = input.buttons[std::size_t(n)];
    io.MouseWheel = float(input.wheel);
    io.KeyShift = input.shift, io.KeyCtrl = input.control;
    for (const auto& [key, down] : input.keys)
        if (key >= 0 && key < int(std::size(io.KeysDown))) io.KeysDown[key] = down;
    for (unsigned c : input.characters) io.AddInputCharacter(c);
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
}

void Gui::end() {
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

bool Gui::wants_pointer() const {
    return ImGui::GetIO().WantCaptureMouse;
}
bool Gui::wants_keys() const {
    return ImGui::GetIO().WantTextInput;
}

}  // namespace innerspring::viewer
