// shiftrig dbc FILE: what a DBC file says, as it was understood.
#include <fmt/format.h>

#include <charconv>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "apps/shiftrig/command.h"
#include "io/can/dbc.h"
#include "io/can/frame.h"

namespace shiftrig::cli {

namespace {

namespace dbc = io::can::dbc;

std::string identifier(const dbc::Message& message) {
    return message.extended ? fmt::format("{:08X}", message.id) : fmt::format("{:03X}", message.id);
}

// Of a 29-bit identifier read as J1939: the destination of a peer-to-peer group is not part of its number.
std::uint32_t parameter_group(std::uint32_t id) {
    return ((id >> 16) & 0xFF) < 240 ? (id >> 8) & 0x3FF00 : (id >> 8) & 0x3FFFF;
}

// 0: none.
std::uint32_t spn(const dbc::Signal& signal) {
    const auto found = signal.attributes.find("SPN");
    std::uint32_t number = 0;
    if (found != signal.attributes.end())
        std::from_chars(found->second.data(), found->second.data() + found->second.size(), number);
    return number;
}

std::string multiplexing(const dbc::Signal& signal) {
    std::string text = signal.is_multiplexor ? "multiplexor" : "";
    if (signal.multiplexor.empty()) return text;
    text += (text.empty() ? "" : ", ") + std::string("where ") + signal.multiplexor + " is";
    for (const auto& [first, last] : signal.selected_by)
        text += first == last ? fmt::format(" {}", first) : fmt::format(" {}…{}", first, last);
    return text;
}

void print(const dbc::Database& database) {
    fmt::print("{}: {} messages, {} nodes\n", database.file, database.messages.size(), database.nodes.size());
    for (const auto& message : database.messages) {
        std::string head =
            fmt::format("\n{} {}  {} bytes", identifier(message), message.name, message.length);
        if (message.extended) head += fmt::format("  PGN {}", parameter_group(message.id));
        if (!message.transmitter.empty()) head += "  from " + message.transmitter;
        if (message.cycle_time_ms() > 0) head += fmt::format("  every {:g} ms", message.cycle_time_ms());
        if (!message.comment.empty()) head += "  (" + message.comment + ")";
        fmt::print("{}\n", head);
        for (const auto& signal : message.signals) {
            std::string line = fmt::format("  {:<28} {:>3}|{:<2} {} {:<8}", signal.name, signal.start_bit,
                                           signal.length, signal.little_endian ? "Intel   " : "Motorola",
                                           signal.type != dbc::ValueType::integer ? "float"
                                           : signal.is_signed                     ? "signed"
                                                                                  : "unsigned");
            line += fmt::format(" · {:<10.8g} + {:<8.8g} {}", signal.factor, signal.offset, signal.unit);
            if (signal.minimum != 0 || signal.maximum != 0)
                line += fmt::format(" [{:g} … {:g}]", signal.minimum, signal.maximum);
            if (const auto number = spn(signal); number != 0) line += fmt::format("  SPN {}", number);
            if (const auto mux = multiplexing(signal); !mux.empty()) line += "  " + mux;
            for (const auto& [value, name] : signal.value_names)
                line += fmt::format("{}{}={}", &name == &signal.value_names.front().second ? "  " : ", ",
                                    value, name);
            fmt::print("{}\n", line);
        }
    }
}

nlohmann::json to_json(const dbc::Signal& signal) {
    nlohmann::json json{{"name", signal.name},
                        {"start_bit", signal.start_bit},
                        {"length", signal.length},
                        {"byte_order", signal.little_endian ? "intel" : "motorola"},
                        {"signed", signal.is_signed},
                        {"type", signal.type == dbc::ValueType::float32   ? "float32"
                                 : signal.type == dbc::ValueType::float64 ? "float64"
                                                                          : "integer"},
                        {"factor", signal.factor},
                        {"offset", signal.offset},
                        {"minimum", signal.minimum},
                        {"maximum", signal.maximum},
                        {"unit", signal.unit},
                        {"receivers", signal.receivers},
                        {"multiplexor", signal.is_multiplexor},
                        {"line", signal.line}};
    if (const auto number = spn(signal); number != 0) json["spn"] = number;
    if (!signal.comment.empty()) json["comment"] = signal.comment;
    if (!signal.multiplexor.empty())
        json["selected_by"] = {{"signal", signal.multiplexor}, {"values", signal.selected_by}};
    for (const auto& [value, name] : signal.value_names) json["values"][std::to_string(value)] = name;
    return json;
}

nlohmann::json to_json(const dbc::Database& database) {
    nlohmann::json json{
        {"file", database.file}, {"version", database.version}, {"warnings", database.warnings}};
    json["nodes"] = nlohmann::json::array();
    for (const auto& node : database.nodes)
        json["nodes"].push_back(
            {{"name", node.name}, {"comment", node.comment}, {"attributes", node.attributes}});
    json["messages"] = nlohmann::json::array();
    for (const auto& message : database.messages) {
        nlohmann::json entry{{"name", message.name},
                             {"id", message.id},
                             {"identifier", identifier(message)},
                             {"extended", message.extended},
                             {"length", message.length},
                             {"transmitter", message.transmitter},
                             {"cycle_time_ms", message.cycle_time_ms()},
                             {"comment", message.comment},
                             {"attributes", message.attributes},
                             {"line", message.line},
                             {"signals", nlohmann::json::array()}};
        if (message.extended) entry["pgn"] = parameter_group(message.id);
        for (const auto& signal : message.signals) entry["signals"].push_back(to_json(signal));
        json["messages"].push_back(std::move(entry));
    }
    return json;
}

struct Options {
    std::string file;
    bool json = false;
};

Command::Run declare(CLI::App& app) {
    const auto options = std::make_shared<Options>();
    app.add_option("FILE", options->file, "DBC file")->required();
    app.add_flag("--json", options->json, "one JSON object");
    return [options] {
        const dbc::Database database = dbc::read(options->file);
        if (options->json) {
            std::cout << to_json(database).dump(2, ' ', false, nlohmann::json::error_handler_t::replace)
                      << '\n';
        } else {
            print(database);
            for (const auto& warning : database.warnings) std::cerr << warning << '\n';
        }
        return int{good};
    };
}

const Command dbc_command("dbc", "the messages and signals of a DBC file", declare);

}  // namespace

}  // namespace shiftrig::cli
