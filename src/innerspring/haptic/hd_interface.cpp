#include "innerspring/haptic/hd_interface.h"

namespace innerspring::hd {

const char* describe(Error code) {
    switch (code) {
        case 0x0100:
            return "invalid enum";
        case 0x0101:
            return "invalid value";
        case 0x0102:
            return "invalid operation";
        case 0x0103:
            return "invalid input type";
        case 0x0104:
            return "bad handle";
        case 0x0200:
            return "warm motors";
        case 0x0201:
            return "exceeded maximal force";
        case 0x0202:
            return "exceeded maximal force impulse";
        case 0x0203:
            return "exceeded maximal velocity";
        case 0x0204:
            return "force error";
        case 0x0300:
            return "device fault";
        case 0x0301:
            return "device already initiated";
        case 0x0302:
            return "communication error";
        case 0x0303:
            return "communication configuration error";
        case 0x0304:
            return "timer error";
        case 0x0400:
            return "illegal begin of a frame";
        case 0x0401:
            return "illegal end of a frame";
        case 0x0402:
            return "frame error";
        case 0x0500:
            return "invalid priority";
        case 0x0501:
            return "scheduler full";
        case 0x0600:
            return "invalid license";
        default:
            return "unknown error";
    }
}

}  // namespace innerspring::hd
