// The dashboard's HTTP side: pages and API on the machine's own loopback, server-sent events out, small JSON
// commands in. It knows nothing of the rig: what is asked of it goes through Handlers, on threads of its own.
//
// Who may do what:
//   * bound to loopback unless told otherwise; any other address needs a token, on every request;
//   * the Host header must name this server (a foreign page cannot reach it by re-binding its own name);
//   * what changes state is a POST of application/json from the same origin;
//   * bodies up to 4 KiB, viewers up to 16, and no part of a request ever becomes a file name.
#pragma once

#include <functional>
#include <istream>
#include <memory>
#include <string>
#include <string_view>

#include "apps/serve/feed.h"

namespace shiftrig::serve {

struct HttpOptions {
    std::string address = "127.0.0.1";
    int port = 8000;    // 0: any free one
    std::string token;  // empty: none (refused unless the address is loopback)
};

struct Handlers {
    std::function<std::string()> model;  // JSON of GET /api/model
    // POST /api/<verb> with its JSON body; returns what is wrong with it, or nothing.
    std::function<std::string(std::string_view verb, const std::string& body)> command;
    // The recording so far, or nullptr if none was made.
    std::function<std::unique_ptr<std::istream>()> recording;
};

class HttpServer {
  public:
    static constexpr int most_viewers = 16;

    // Listens at once; throws std::runtime_error if the address cannot be had, std::invalid_argument if it is
    // not loopback and no token is given.
    HttpServer(const HttpOptions& options, Feed& feed, Handlers handlers);
    ~HttpServer();  // ends the feed and every connection

    int port() const;
    std::string url() const;

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

}  // namespace shiftrig::serve
