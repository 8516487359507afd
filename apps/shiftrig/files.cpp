#include "apps/shiftrig/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include "io/input_error.h"

namespace shiftrig::cli {

namespace {

namespace fs = std::filesystem;

const char* const standard_output = "-";

// Where a file is or would be made: also through a link to a name that is not there yet.
fs::path place_of(fs::path path) {
    std::error_code error;
    for (int links = 0; links < 40 && fs::is_symlink(path, error); ++links)
        path = path.parent_path() / fs::read_symlink(path, error);
    return fs::weakly_canonical(fs::absolute(path, error), error);
}

bool same_file(const std::string& a, const std::string& b) {
    struct stat of_a = {}, of_b = {};
    if (stat(a.c_str(), &of_a) != 0 || stat(b.c_str(), &of_b) != 0) return place_of(a) == place_of(b);
    const bool takes_anything = S_ISCHR(of_a.st_mode);  // /dev/null may well be given twice
    return of_a.st_dev == of_b.st_dev && of_a.st_ino == of_b.st_ino && !takes_anything;
}

void require_writable(const std::string& path) {
    const auto refuse = [&](int error) {
        throw io::InputError(path + ": cannot be written: " + std::strerror(error));
    };
    const auto require = [&](const std::string& name, int access) {
        if (faccessat(AT_FDCWD, name.c_str(), access, AT_EACCESS) != 0) refuse(errno);
    };
    struct stat info = {};
    if (stat(path.c_str(), &info) == 0) {
        if (S_ISDIR(info.st_mode)) refuse(EISDIR);
        return require(path, W_OK);
    }
    if (errno != ENOENT) refuse(errno);
    const fs::path place = place_of(path);
    if (!place.has_filename()) refuse(EISDIR);
    const std::string folder = place.parent_path().string();
    if (stat(folder.c_str(), &info) != 0) refuse(errno);
    if (!S_ISDIR(info.st_mode)) refuse(ENOTDIR);
    require(folder, W_OK | X_OK);
}

const CLI::Validator not_empty(
    [](const std::string& name) { return name.empty() ? std::string("must name a file") : std::string(); },
    "", "not empty");

const CLI::Validator no_standard_output(
    [](const std::string& name) {
        return name == standard_output
                   ? std::string("- is standard output, which this cannot go to; ./- is a file of that name")
                   : std::string();
    },
    "", "not standard output");

CLI::Option* check_values(CLI::Option* option, const CLI::Validator& validator, int first) {
    return option->check(first > 0 ? validator.application_index(first) : validator);
}

// The first of `others` that is the file of `output`.
std::optional<NamedFile> clash(const NamedFile& output, const std::vector<NamedFile>& others) {
    for (const auto& other : others)
        if (same_file(output.path, other.path)) return other;
    return std::nullopt;
}

[[noreturn]] void refuse(const NamedFile& output, const NamedFile& other, const std::string& why) {
    const std::string spelling = other.path == output.path ? "" : " (" + other.path + ")";
    throw CLI::ValidationError(output.option + " " + output.path,
                               "is the file of " + other.option + spelling + why);
}

}  // namespace

CLI::Option* Files::read(CLI::Option* option) {
    read_.push_back({option, 0});
    return check_values(option, not_empty, 0);
}

CLI::Option* Files::written(CLI::Option* option, StandardOutput may_be, int first) {
    written_.push_back({option, first});
    if (may_be == StandardOutput::no) check_values(option, no_standard_output, first);
    return check_values(option, not_empty, first);
}

std::vector<NamedFile> Files::named(const std::vector<Marked>& options) {
    std::vector<NamedFile> files;
    for (const auto& [option, first] : options) {
        const auto& values = option->results();
        for (auto i = static_cast<std::size_t>(first); i < values.size(); ++i)
            files.push_back({option->get_name(), values[i]});
    }
    return files;
}

void Files::check(const std::vector<NamedFile>& also_read, const std::vector<NamedFile>& also_written) const {
    std::vector<NamedFile> inputs = named(read_), outputs = named(written_), before;
    inputs.insert(inputs.end(), also_read.begin(), also_read.end());
    outputs.insert(outputs.end(), also_written.begin(), also_written.end());
    const NamedFile* on_standard_output = nullptr;
    for (const auto& output : outputs) {
        if (output.path == standard_output) {
            if (on_standard_output)
                throw CLI::ValidationError(output.option + " -",
                                           "standard output is taken by " + on_standard_output->option);
            on_standard_output = &output;
            continue;
        }
        if (const auto input = clash(output, inputs)) refuse(output, *input, ", which it would overwrite");
        if (const auto other = clash(output, before)) refuse(output, *other, ", too; each needs its own");
        before.push_back(output);
    }
    for (const auto& output : before) require_writable(output.path);
}

bool keeps_what_is_written(const std::string& path) {
    struct stat info = {};
    return stat(path.c_str(), &info) != 0 || S_ISREG(info.st_mode);
}

PassingFile::PassingFile(const std::string& neighbour, const std::string& ending) {
    // Links are followed: that of /dev/stdout may lead to a file, which need not have a name any more.
    const fs::path place = place_of(neighbour);
    std::error_code none;
    const bool has_a_place =
        keeps_what_is_written(neighbour) && (fs::exists(place, none) || !fs::exists(neighbour, none));
    const std::string name = has_a_place ? place.string() : (fs::temp_directory_path() / "shiftrig").string();
    path_ = name + ".XXXXXX" + ending;
    const int file = mkstemps(path_.data(), static_cast<int>(ending.size()));
    if (file < 0)
        throw io::InputError((has_a_place ? neighbour : name) +
                             ": cannot be written: " + std::strerror(errno));
    close(file);
}

PassingFile::~PassingFile() {
    unlink(path_.c_str());
}

}  // namespace shiftrig::cli
