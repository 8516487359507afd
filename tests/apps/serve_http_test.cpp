// Who may ask the dashboard's server for what. The rig is not needed: the handlers count what reaches them.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "apps/serve/http.h"

namespace {

using namespace shiftrig::serve;

class Client {
  public:
    explicit Client(int port) : socket_(socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(static_cast<std::uint16_t>(port));
        inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
        const timeval patience{5, 0};
        setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
        connected = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    }
    ~Client() { close(socket_); }
    Client(const Client&) = delete;
    void send(const std::string& text) const { ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
    // Reads until `wanted` has come, the server closes, or it is silent for five seconds.
    std::string read_until(const std::string& wanted) const {
        std::string all;
        char part[4096];
        for (ssize_t n;
             all.find(wanted) == std::string::npos && (n = recv(socket_, part, sizeof part, 0)) > 0;)
            all.append(part, static_cast<std::size_t>(n));
        return all;
    }
    bool connected = false;

  private:
    int socket_;
};

class Http : public testing::Test {
  protected:
    Handlers handlers() {
        return {
            [] { return std::string(R"({"name":"test"})"); },
            [this](std::string_view verb, const std::string& body) {
                ++commands;
                last = std::string(verb) + body;
                return std::string(verb == "input" ? "" : "no such command");
            },
            [this] { return recorded.empty() ? nullptr : std::make_unique<std::istringstream>(recorded); }};
    }
    std::string host() const { return "Host: 127.0.0.1:" + std::to_string(server.port()) + "\r\n"; }
    std::string ask(const std::string& request) const {
        Client client(server.port());
        client.send(request);
        return client.read_until("\r\n\r\n");
    }
    std::string post(const std::string& headers,
                     const std::string& body = R"({"signal":"x","value":1})") const {
        return ask("POST /api/input HTTP/1.1\r\n" + host() +
                   "Content-Length: " + std::to_string(body.size()) + "\r\n" + headers + "\r\n" + body);
    }

    Feed feed;
    std::atomic<int> commands{0};
    std::string last, recorded;
    HttpServer server{{"127.0.0.1", 0, ""}, feed, handlers()};
};

TEST_F(Http, OwnPageMayCommand) {
    const std::string answer =
        post("Content-Type: application/json\r\nOrigin: http://127.0.0.1:" + std::to_string(server.port()) +
             "\r\nSec-Fetch-Site: same-origin\r\n");
    EXPECT_NE(answer.find("200"), std::string::npos) << answer;
    EXPECT_EQ(last, R"(input{"signal":"x","value":1})");
}

TEST_F(Http, ForeignPageMayNotCommand) {
    EXPECT_NE(post("Content-Type: application/json\r\nOrigin: http://evil.example\r\n").find("403"),
              std::string::npos);
    EXPECT_NE(post("Content-Type: application/json\r\nSec-Fetch-Site: cross-site\r\n").find("403"),
              std::string::npos);
    EXPECT_NE(post("Content-Type: text/plain\r\n").find("403"),
              std::string::npos);  // what a bare form can send
    EXPECT_EQ(commands, 0);
}

TEST_F(Http, ForeignHostNameIsRefused) {
    EXPECT_NE(ask("GET /api/model HTTP/1.1\r\nHost: evil.example\r\n\r\n").find("403"), std::string::npos);
    EXPECT_NE(ask("GET /api/model HTTP/1.1\r\n\r\n").find("403"), std::string::npos);
}

TEST_F(Http, BodyOverFourKibibytesIsRefused) {
    EXPECT_NE(post("Content-Type: application/json\r\n", std::string(5000, 'x')).find("413"),
              std::string::npos);
    EXPECT_EQ(commands, 0);
}

TEST_F(Http, NoRequestBecomesAFileName) {
    for (const std::string path :
         {"/../../etc/passwd", "/etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/api/recording/../x"})
        EXPECT_NE(ask("GET " + path + " HTTP/1.1\r\n" + host() + "\r\n").find("404"), std::string::npos)
            << path;
}

TEST_F(Http, ALongRecordingComesWhole) {
    const std::string request = "GET /api/recording HTTP/1.1\r\n" + host() + "\r\n";
    EXPECT_NE(ask(request).find("404"), std::string::npos) << "none was made yet";
    recorded = std::string(300'000, 'r') + "its end";
    Client client(server.port());
    client.send(request);
    const std::string answer = client.read_until("\r\n0\r\n");  // the last of the chunks
    EXPECT_GE(std::count(answer.begin(), answer.end(), 'r'), 300'000);
    EXPECT_NE(answer.find("its end"), std::string::npos);
}

TEST_F(Http, AViewerSeesChangesAndTheNewestSample) {
    feed.change("change", R"({"text":"F2 locks"})");
    feed.sample(R"({"t":1})");
    feed.sample(R"({"t":2})");
    Client viewer(server.port());
    viewer.send("GET /api/live HTTP/1.1\r\n" + host() + "\r\n");
    const std::string seen = viewer.read_until(R"({"t":2})");
    EXPECT_NE(seen.find("event: change\ndata: {\"text\":\"F2 locks\"}"), std::string::npos) << seen;
    EXPECT_EQ(seen.find(R"({"t":1})"), std::string::npos) << "an old sample was sent";
    EXPECT_NE(seen.find(R"({"t":2})"), std::string::npos);
}

TEST_F(Http, TheSeventeenthViewerIsTurnedAway) {
    std::vector<std::unique_ptr<Client>> viewers;
    const std::string request = "GET /api/live HTTP/1.1\r\n" + host() + "\r\n";
    for (int i = 0; i < HttpServer::most_viewers; ++i) {
        viewers.push_back(std::make_unique<Client>(server.port()));
        viewers.back()->send(request);
        EXPECT_NE(viewers.back()->read_until("200 OK").find("200 OK"), std::string::npos);
    }
    EXPECT_NE(ask(request).find("503"), std::string::npos);
}

TEST_F(Http, TwoHundredSilentConnectionsDoNotKeepTheOwnerOut) {
    std::vector<std::unique_ptr<Client>> silent;
    for (int i = 0; i < 200; ++i) silent.push_back(std::make_unique<Client>(server.port()));
    std::string answer;
    for (int attempt = 0; attempt < 5 && answer.find("200") == std::string::npos; ++attempt)
        answer = post("Content-Type: application/json\r\n");
    EXPECT_NE(answer.find("200"), std::string::npos) << answer;
}

TEST_F(Http, AViewerThatNeverReadsHoldsNobodyUp) {
    Client deaf(server.port());
    deaf.send("GET /api/live HTTP/1.1\r\n" + host() + "\r\n");
    const std::string large(1 << 20, '1');
    for (int i = 0; i < 50; ++i) {
        feed.sample(large);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_NE(post("Content-Type: application/json\r\n").find("200"), std::string::npos);
}

const Handlers silent_handlers{[] { return std::string("{}"); },
                               [](std::string_view, const std::string&) { return std::string(); },
                               [] { return nullptr; }};

TEST(HttpToken, AnOpenAddressNeedsAToken) {
    Feed feed;
    try {
        HttpServer server({"0.0.0.0", 0, ""}, feed, silent_handlers);
        FAIL() << "listened without a token";
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(),
                     "--address 0.0.0.0 is open to others; give a --token of your choice with it");
    }
}

TEST(HttpToken, AWrongTokenIsRefusedOnEveryPath) {
    Feed feed;
    HttpServer server({"127.0.0.1", 0, "right"}, feed, silent_handlers);
    auto ask = [&](const std::string& path) {
        Client client(server.port());
        client.send("GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
        return client.read_until("\r\n\r\n");
    };
    for (const std::string path :
         {"/", "/api/model", "/api/live", "/api/recording", "/api/model?token=wrong", "/api/model?token="})
        EXPECT_NE(ask(path).find("403"), std::string::npos) << path;
    EXPECT_NE(ask("/api/model?token=right").find("200"), std::string::npos);
}

TEST(HttpPort, ATakenPortIsSaidAloud) {
    Feed feed, other;
    HttpServer server({"127.0.0.1", 0, ""}, feed, silent_handlers);
    EXPECT_THROW(HttpServer({"127.0.0.1", server.port(), ""}, other, silent_handlers), std::runtime_error);
}

}  // namespace
