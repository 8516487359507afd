#include "io/yaml_document.h"

#include <algorithm>

namespace shiftrig::io {

void fail(const std::string& path, const YAML::Mark& mark, const std::string& what) {
    throw InputError(path, mark.line + 1, mark.column + 1, what);
}

namespace {

// An alias may name a node around it, or multiply into more nodes than any machine has.
class AliasWatch {
  public:
    explicit AliasWatch(const std::string& path) : path_(path) {}

    void walk(const YAML::Node& node) {
        if (++count_ > most_nodes) fail(path_, node.Mark(), "aliases unfold into too much");
        for (const auto& around : around_)
            if (around.is(node)) fail(path_, node.Mark(), "an alias names the map or list it stands in");
        if (!node.IsMap() && !node.IsSequence()) return;
        around_.push_back(node);
        for (const auto& item : node) walk(node.IsMap() ? item.second : item);
        around_.pop_back();
    }

  private:
    static constexpr int most_nodes = 1'000'000;
    const std::string& path_;
    std::vector<YAML::Node> around_;
    int count_ = 0;
};

}  // namespace

YAML::Node parse_yaml(const std::string& text, const std::string& path) {
    try {
        const YAML::Node root = YAML::Load(text);
        if (!root || root.IsNull()) throw InputError(path, 1, 1, "the file is empty");
        AliasWatch(path).walk(root);
        return root;
    } catch (const YAML::Exception& error) {
        fail(path, error.mark, "not valid YAML: " + error.msg);
    }
}

std::vector<Entry> entries(const std::string& path, const YAML::Node& map, const YAML::Mark& at,
                           const std::string& owner) {
    if (!map.IsMap())
        fail(
            path, at,
            (owner.empty() ? "the file " : owner) + "= " + as_written(map) + "; must be a map of key: value");
    std::vector<Entry> own, merged;
    const auto holds = [](const std::vector<Entry>& list, const std::string& key) {
        return std::any_of(list.begin(), list.end(), [&](const Entry& entry) { return entry.key == key; });
    };
    const auto merge = [&](const YAML::Node& from, const YAML::Mark& mark) {
        for (auto& entry : entries(path, from, mark, owner + "<< "))
            if (!holds(merged, entry.key)) merged.push_back(std::move(entry));
    };
    for (const auto& pair : map) {
        const YAML::Mark mark = pair.first.Mark();
        if (!pair.first.IsScalar()) fail(path, mark, owner + "a key must be a plain word");
        const std::string key = pair.first.Scalar();
        if (key == "<<") {
            if (pair.second.IsSequence())
                for (const auto& from : pair.second) merge(from, mark);
            else
                merge(pair.second, mark);
            continue;
        }
        if (holds(own, key)) fail(path, mark, owner + key + " is given twice");
        own.push_back({key, mark, pair.second});
    }
    for (auto& entry : merged)
        if (!holds(own, entry.key)) own.push_back(std::move(entry));
    return own;
}

std::string as_written(const YAML::Node& node) {
    if (!node || node.IsNull()) return "(nothing)";
    if (node.IsScalar()) return node.Scalar().empty() ? "\"\"" : node.Scalar();
    YAML::Emitter out;
    out.SetMapFormat(YAML::Flow);
    out.SetSeqFormat(YAML::Flow);
    out << node;
    std::string text = out.c_str();
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text.size() <= 60 ? text : text.substr(0, 57) + "...";
}

}  // namespace shiftrig::io
