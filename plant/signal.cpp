#include "plant/signal.h"

namespace shiftrig::plant {

std::string_view suffix(Unit unit) {
    switch (unit) {
        case Unit::one:
            return "";
        case Unit::radian:
            return "_rad";
        case Unit::radian_per_second:
            return "_rad_s";
        case Unit::metre:
            return "_m";
        case Unit::metre_per_second:
            return "_m_s";
        case Unit::metre_per_second2:
            return "_m_s2";
        case Unit::newton:
            return "_n";
        case Unit::newton_metre:
            return "_nm";
        case Unit::pascal:
            return "_pa";
        case Unit::ampere:
            return "_a";
        case Unit::joule:
            return "_j";
        case Unit::watt:
            return "_w";
        case Unit::celsius:
            return "_degc";
        case Unit::second:
            return "_s";
        case Unit::kilogram:
            return "_kg";
    }
    return "";
}

std::string_view symbol(Unit unit) {
    switch (unit) {
        case Unit::one:
            return "";
        case Unit::radian:
            return "rad";
        case Unit::radian_per_second:
            return "rad/s";
        case Unit::metre:
            return "m";
        case Unit::metre_per_second:
            return "m/s";
        case Unit::metre_per_second2:
            return "m/s²";
        case Unit::newton:
            return "N";
        case Unit::newton_metre:
            return "Nm";
        case Unit::pascal:
            return "Pa";
        case Unit::ampere:
            return "A";
        case Unit::joule:
            return "J";
        case Unit::watt:
            return "W";
        case Unit::celsius:
            return "°C";
        case Unit::second:
            return "s";
        case Unit::kilogram:
            return "kg";
    }
    return "";
}

}  // namespace shiftrig::plant
