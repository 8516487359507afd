#include "apps/serve/http.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <httplib.h>
#pragma GCC diagnostic pop

#include <arpa/inet.h>

#include <atomic>
#include <set>
#include <stdexcept>
#include <thread>

#include "apps/serve/page.h"

namespace shiftrig::serve {

namespace {

constexpr auto heartbeat = std::chrono::milliseconds(1000);
constexpr std::size_t longest_command = 4096;  // bytes of a POST

bool is_loopback(const std::string& address) {
    in_addr v4{};
    if (inet_pton(AF_INET, address.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
    in6_addr v6{};
    if (inet_pton(AF_INET6, address.c_str(), &v6) == 1) return IN6_IS_ADDR_LOOPBACK(&v6);
    return address == "localhost";
}

// Takes as long for a wrong token as for the right one.
bool same_token(const std::string& given, const std::string& wanted) {
    unsigned difference = given.size() == wanted.size() ? 0U : 1U;
    for (std::size_t i = 0; i < wanted.size(); ++i)
        difference |= static_cast<unsigned char>(wanted[i]) ^
                      static_cast<unsigned char>(given.empty() ? 0 : given[i % given.size()]);
    return difference == 0;
}

}  // namespace

struct HttpServer::Implementation {
    Implementation(const HttpOptions& chosen, Feed& the_feed, Handlers the_handlers)
        : options(chosen), feed(the_feed), handlers(std::move(the_handlers)) {}

    HttpOptions options;
    Feed& feed;
    Handlers handlers;
    httplib::Server server;
    std::thread thread;
    std::atomic<int> viewers{0};
    int port = 0;

    // What speaks against answering a request; empty: nothing.
    std::string refusal(const httplib::Request& request) const {
        const std::string host = request.get_header_value("Host");
        const std::string number = ":" + std::to_string(port);
        const std::set<std::string> ours = {options.address + number, "[" + options.address + "]" + number,
                                            "127.0.0.1" + number, "localhost" + number, "[::1]" + number};
        if (options.token.empty() && ours.count(host) == 0)
            return "this server is not called \"" + host + "\"";
        if (!options.token.empty()) {
            const std::string given = request.has_param("token")
                                          ? request.get_param_value("token")
                                          : request.get_header_value("X-Shiftrig-Token");
            if (!same_token(given, options.token)) return "wrong or missing token";
        }
        if (request.method != "POST") return "";
        if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + host)
            return "commands come from this server's own page only";
        const std::string site = request.get_header_value("Sec-Fetch-Site");
        if (!site.empty() && site != "same-origin" && site != "none")
            return "commands come from this server's own page only";
        if (request.get_header_value("Content-Type").rfind("application/json", 0) != 0)
            return "a command is application/json";
        return "";
    }

    void answer_live(httplib::Response& response) {
        if (viewers.fetch_add(1) >= most_viewers) {
            viewers.fetch_sub(1);
            response.status = 503;
            response.set_content("at most " + std::to_string(most_viewers) + " viewers at a time\n",
                                 "text/plain");
            return;
        }
        auto cursor = std::make_shared<Feed::Cursor>(feed.join());
        response.set_header("Cache-Control", "no-store");
        response.set_chunked_content_provider(
            "text/event-stream",
            [this, cursor](std::size_t, httplib::DataSink& sink) {
                std::string text;
                if (!feed.wait(*cursor, text, heartbeat)) {
                    sink.done();
                    return true;
                }
                return sink.write(text.data(),
                                  text.size());  // false after the write timeout: the viewer is dropped
            },
            [this](bool) { viewers.fetch_sub(1); });
    }

    void declare() {
        server.new_task_queue = [] { return new httplib::ThreadPool(most_viewers + 80); };
        server.set_payload_max_length(longest_command);
        server.set_keep_alive_max_count(50);
        server.set_keep_alive_timeout(1);
        server.set_read_timeout(1);
        server.set_write_timeout(2);
        server.set_tcp_nodelay(true);
        // The default would let two rigs share one port without a word.
        server.set_socket_options([](socket_t socket) {
            const int yes = 1;
            setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        });
        server.set_default_headers(
            {{"X-Content-Type-Options", "nosniff"},
             {"X-Frame-Options", "DENY"},
             {"Referrer-Policy", "no-referrer"},
             {"Content-Security-Policy",
              "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
              "img-src data:; connect-src 'self'; base-uri 'none'; form-action 'none'"}});
        server.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
            const std::string why = refusal(request);
            if (why.empty()) return httplib::Server::HandlerResponse::Unhandled;
            response.status = 403;
            response.set_content(why + "\n", "text/plain");
            return httplib::Server::HandlerResponse::Handled;
        });
        server.set_error_handler([](const httplib::Request&, httplib::Response& response) {
            if (!response.body.empty()) return;
            response.set_content(response.status == 404 ? "there is nothing of this name here\n"
                                 : response.status == 413
                                     ? "a command has at most " + std::to_string(longest_command) + " bytes\n"
                                     : std::string("this is no request that the dashboard understands\n"),
                                 "text/plain");
        });
        server.Get("/", [](const httplib::Request&, httplib::Response& response) {
            response.set_content(dashboard_page.data(), dashboard_page.size(), "text/html; charset=utf-8");
        });
        server.Get("/api/model", [this](const httplib::Request&, httplib::Response& response) {
            response.set_content(handlers.model(), "application/json");
        });
        server.Get("/api/live",
                   [this](const httplib::Request&, httplib::Response& response) { answer_live(response); });
        server.Get("/api/recording", [this](const httplib::Request&, httplib::Response& response) {
            std::shared_ptr<std::istream> recording = handlers.recording();
            if (!recording) {
                response.status = 404;
                response.set_content("nothing has been recorded: press Record first\n", "text/plain");
                return;
            }
            response.set_header("Content-Disposition", "attachment; filename=\"shiftrig.lcm\"");
            response.set_chunked_content_provider(  // piece by piece: it may be gigabytes
                "application/octet-stream", [recording](std::size_t, httplib::DataSink& sink) {
                    char piece[65536];
                    const auto count = recording->read(piece, sizeof piece).gcount();
                    if (count > 0) return sink.write(piece, static_cast<std::size_t>(count));
                    sink.done();
                    return true;
                });
        });
        server.Post(R"(/api/([a-z]+))", [this](const httplib::Request& request, httplib::Response& response) {
            const std::string wrong = handlers.command(request.matches[1].str(), request.body);
            response.status = wrong.empty() ? 200 : 400;
            response.set_content(wrong.empty() ? "{}" : wrong + "\n",
                                 wrong.empty() ? "application/json" : "text/plain");
        });
    }
};

HttpServer::HttpServer(const HttpOptions& options, Feed& feed, Handlers handlers)
    : implementation_(std::make_unique<Implementation>(options, feed, std::move(handlers))) {
    if (!is_loopback(options.address) && options.token.empty())
        throw std::invalid_argument("--address " + options.address +
                                    " is open to others; give a --token of your choice with it");
    auto& self = *implementation_;
    self.declare();
    self.port = options.port;
    const bool bound = options.port == 0
                           ? (self.port = self.server.bind_to_any_port(options.address.c_str())) > 0
                           : self.server.bind_to_port(options.address.c_str(), options.port);
    if (!bound)
        throw std::runtime_error("cannot listen on " + options.address + ":" + std::to_string(options.port) +
                                 "; is another rig running there? --port 0 takes any free one");
    self.thread = std::thread([&self] { self.server.listen_after_bind(); });
    while (!self.server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

HttpServer::~HttpServer() {
    implementation_->feed.close();
    implementation_->server.stop();
    implementation_->thread.join();
}

int HttpServer::port() const {
    return implementation_->port;
}

std::string HttpServer::url() const {
    const auto& options = implementation_->options;
    return "http://" + options.address + ":" + std::to_string(port()) + "/" +
           (options.token.empty() ? "" : "?token=" + options.token);
}

}  // namespace shiftrig::serve
