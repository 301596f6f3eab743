#pragma once

/// The part of the OpenHaptics HD interface (3.0) that is used here, in declarations of our own: types,
/// numbers and names as facts, for a library that is loaded at run time. Positions are in mm, velocities in
/// mm/s, forces in newtons.
namespace innerspring::hd {

using Handle = unsigned int;
using Enum = unsigned int;
using Error = unsigned int;
using Boolean = unsigned char;
using CallbackCode = unsigned int;
using SchedulerHandle = unsigned long;

struct ErrorInfo {  ///< returned by value
    Error code;
    int internal_code;
    Handle device;
};

#if defined(_WIN32)
#define INNERSPRING_HD_CALL __cdecl  // not verified with the vendor's header
#else
#define INNERSPRING_HD_CALL
#endif
using Callback = CallbackCode(INNERSPRING_HD_CALL*)(void*);

inline constexpr Handle invalid_handle = 0xFFFFFFFFu;
inline constexpr CallbackCode callback_done = 0, callback_continue = 1;
inline constexpr unsigned short default_priority = 32767;

inline constexpr Enum current_buttons = 0x2000, current_velocity = 0x2051, current_transform = 0x2052,
                      device_model_type = 0x2501, usable_workspace = 0x2551, input_dof = 0x2553,
                      output_dof = 0x2554, nominal_max_stiffness = 0x2602, nominal_max_force = 0x2603,
                      nominal_max_continuous_force = 0x2604, nominal_max_damping = 0x2609,
                      current_force = 0x2700, force_output = 0x4000, max_force_clamping = 0x4001,
                      software_force_limit = 0x4003, calibration_ok = 0x5000,
                      calibration_needs_update = 0x5001, calibration_needs_manual_input = 0x5002,
                      calibration_style = 0x2555;
inline constexpr int calibration_encoder_reset = 1, calibration_auto = 2, calibration_inkwell = 4;

/// X(return type, name without "hd", arguments)
#define INNERSPRING_HD_FUNCTIONS(X)                                             \
    X(Handle, InitDevice, (const char*))                                        \
    X(void, DisableDevice, (Handle))                                            \
    X(void, MakeCurrentDevice, (Handle))                                        \
    X(void, BeginFrame, (Handle))                                               \
    X(void, EndFrame, (Handle))                                                 \
    X(void, Enable, (Enum))                                                     \
    X(void, Disable, (Enum))                                                    \
    X(void, GetDoublev, (Enum, double*))                                        \
    X(void, GetIntegerv, (Enum, int*))                                          \
    X(const char*, GetString, (Enum))                                           \
    X(void, SetDoublev, (Enum, const double*))                                  \
    X(ErrorInfo, GetError, ())                                                  \
    X(const char*, GetErrorString, (Error))                                     \
    X(void, StartScheduler, ())                                                 \
    X(void, StopScheduler, ())                                                  \
    X(void, SetSchedulerRate, (unsigned long))                                  \
    X(SchedulerHandle, ScheduleAsynchronous, (Callback, void*, unsigned short)) \
    X(void, Unschedule, (SchedulerHandle))                                      \
    X(Enum, CheckCalibration, ())                                               \
    X(void, UpdateCalibration, (Enum))

struct Functions {
#define INNERSPRING_HD_MEMBER(result, name, arguments) result(INNERSPRING_HD_CALL* name) arguments = nullptr;
    INNERSPRING_HD_FUNCTIONS(INNERSPRING_HD_MEMBER)
#undef INNERSPRING_HD_MEMBER
};

/// The vendor's name of an error, in words.
const char* describe(Error code);

}  // namespace innerspring::hd
