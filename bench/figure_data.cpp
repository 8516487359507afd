// shiftrig_figure_data NAME: writes the CSV behind one figure of docs/validation.md to standard output.
#include "bench/figure_data.h"

#include <cstring>

namespace {

struct Figure {
    const char* name;
    void (*write)(std::FILE*);
};

constexpr Figure all[] = {
    {"coupled_clutches", shiftrig::figures::coupled_clutches},
    {"lossy_gear", shiftrig::figures::lossy_gear},
    {"friction", shiftrig::figures::friction},
    {"stick_slip", shiftrig::figures::stick_slip},
    {"light_body", shiftrig::figures::light_body},
    {"wrong_models", shiftrig::figures::wrong_models},
    {"table_2", shiftrig::figures::table_2},
    {"shift", shiftrig::figures::shift},
    {"order", shiftrig::figures::order},
    {"work_precision", shiftrig::figures::work_precision},
    {"sensitivity", shiftrig::figures::sensitivity},
    {"random_systems", shiftrig::figures::random_systems},
};

}  // namespace

int main(int argc, char** argv) {
    if (argc == 2)
        for (const Figure& figure : all)
            if (std::strcmp(figure.name, argv[1]) == 0) {
                figure.write(stdout);
                return 0;
            }
    std::fputs("usage: shiftrig_figure_data NAME, one of:", stderr);
    for (const Figure& figure : all) std::fprintf(stderr, " %s", figure.name);
    std::fputs("\n", stderr);
    return 2;
}
