// SPDX-License-Identifier: MIT
// Lookup, TCP, TLS, upgrade and messages, by WinHTTP. Its TLS is Schannel.
#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <boost/asio/post.hpp>

#include "clients/native/transport.h"
#include "clients/websocket/web_socket_connection.h"
#include "clients/websocket/winhttp/windows_text.h"
#include "clients/websocket/winhttp/winhttp_link.h"
#include "proto/text/printable.h"

namespace clothstream {

namespace net = boost::asio;
using Stage = WebSocketEnd::Stage;

namespace {

// Longest time to connect, to send the request, and to wait for the answer.
constexpr int kHandshakeTimeoutMs = 10'000;
// Longest text of an HTTP answer that is shown.
constexpr DWORD kMaxShownText = 300;
constexpr std::size_t kFirstBufferBytes = std::size_t{64} << 10;
constexpr DWORD kSwitchingProtocols = 101;
constexpr USHORT kNormalClosure = 1000;

struct CloseHandleOfWinHttp {
  void operator()(HINTERNET handle) const { WinHttpCloseHandle(handle); }
};
using WinHttpHandle = std::unique_ptr<void, CloseHandleOfWinHttp>;

[[noreturn]] void throwLastError(const char* call) {
  throw std::runtime_error(std::string(call) + " failed: " + windowsErrorText(GetLastError()));
}

// Whether TLS has failed, which some versions report as a part of connecting.
bool isOfTls(DWORD error) {
  return error == ERROR_WINHTTP_SECURE_FAILURE || error == ERROR_WINHTTP_SECURE_CHANNEL_ERROR;
}

// First line of a text from outside.
std::string firstLine(std::string_view text) {
  return printable(text.substr(0, std::min<std::size_t>(text.find_first_of("\r\n"), kMaxShownText)));
}

// WinHTTP calls back on its own threads even after the last stream is closed, so the library is never
// unloaded.
void keepLibraryLoaded() {
  HMODULE pinned = nullptr;
  GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_PIN | GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS,
                     reinterpret_cast<LPCWSTR>(&keepLibraryLoaded), &pinned);
}

}  // namespace

struct WebSocketConnector::Shared {
  Shared(net::io_context& context, const ServerAddress& address) : io(context), server(address) {
    if (server.isEncrypted()) check = std::make_shared<const CertificateCheck>(server);
    session.reset(WinHttpOpen(L"clothstream", WINHTTP_ACCESS_TYPE_NO_PROXY, WINHTTP_NO_PROXY_NAME,
                              WINHTTP_NO_PROXY_BYPASS, WINHTTP_FLAG_ASYNC));
    if (!session) throwLastError("WinHttpOpen");
    // Versions of Windows without TLS 1.3 refuse its flag.
    DWORD protocols = WINHTTP_FLAG_SECURE_PROTOCOL_TLS1_2 | WINHTTP_FLAG_SECURE_PROTOCOL_TLS1_3;
    if (!WinHttpSetOption(session.get(), WINHTTP_OPTION_SECURE_PROTOCOLS, &protocols, sizeof protocols)) {
      protocols = WINHTTP_FLAG_SECURE_PROTOCOL_TLS1_2;
      WinHttpSetOption(session.get(), WINHTTP_OPTION_SECURE_PROTOCOLS, &protocols, sizeof protocols);
    }
    constexpr int kNoLimit = 0;
    WinHttpSetTimeouts(session.get(), kNoLimit, kHandshakeTimeoutMs, kHandshakeTimeoutMs,
                       kHandshakeTimeoutMs);
    keepLibraryLoaded();
    if (WinHttpSetStatusCallback(session.get(), &WinHttpLink::called, WINHTTP_CALLBACK_FLAG_ALL_NOTIFICATIONS,
                                 0) == WINHTTP_INVALID_STATUS_CALLBACK)
      throwLastError("WinHttpSetStatusCallback");
    openHost();
    if (!connect) throwLastError("WinHttpConnect");
  }
  // Without a handle, the next request fails.
  void goTo(const ServerAddress& address) {
    if (address.address == server.address) return;
    server = address;
    if (check) check = std::make_shared<const CertificateCheck>(check->at(server.host()));
    openHost();
  }
  void openHost() {
    // A v6 address has brackets, so that the Host field has them.
    const std::string host = server.hostAndPort();
    connect.reset(WinHttpConnect(session.get(), utf16(host.substr(0, host.rfind(':'))).c_str(),
                                 static_cast<INTERNET_PORT>(std::stoul(server.port())), 0));
  }

  net::io_context& io;
  ServerAddress server;
  std::shared_ptr<const CertificateCheck> check;  // with TLS
  WinHttpHandle session, connect;
};

namespace {

// Shared is that of the connector.
template <typename Shared>
class Connection final : public WebSocketConnection, public WinHttpListener {
 public:
  Connection(Shared& shared, WebSocketListener& listener)
      : shared_(shared),
        listener_(listener),
        link_(std::make_shared<WinHttpLink>(shared.io, shared.check, *this)) {
    if (!sendRequest()) end(GetLastError());
  }
  ~Connection() { link_->detach(); }

  void read() override {
    if (ended_) return;
    reading_ = true;
    filled_ = 0;
    receive();
  }
  void write(std::string message) override {
    if (ended_) return;
    link_->outgoing = std::move(message);
    const DWORD error =
        WinHttpWebSocketSend(socket_.get(), WINHTTP_WEB_SOCKET_BINARY_MESSAGE_BUFFER_TYPE,
                             link_->outgoing.data(), static_cast<DWORD>(link_->outgoing.size()));
    if (error != NO_ERROR) writeFailed(error);
  }
  // The read that is under way gets the server's answer.
  void close() override {
    if (ended_) return;
    sayGoodbye();
  }
  void cancel() override { end(ERROR_OPERATION_ABORTED); }

 private:
  bool sendRequest() {
    request_.reset(WinHttpOpenRequest(shared_.connect.get(), L"GET", L"/stream", nullptr, WINHTTP_NO_REFERER,
                                      WINHTTP_DEFAULT_ACCEPT_TYPES, shared_.check ? WINHTTP_FLAG_SECURE : 0));
    if (!request_) return false;
    DWORD_PTR context = link_->newContext();
    if (!WinHttpSetOption(request_.get(), WINHTTP_OPTION_CONTEXT_VALUE, &context, sizeof context)) {
      WinHttpLink::freeContext(context);
      return false;
    }
    DWORD without = WINHTTP_DISABLE_COOKIES | WINHTTP_DISABLE_REDIRECTS | WINHTTP_DISABLE_AUTHENTICATION;
    // CertificateCheck decides. The request has nothing secret.
    DWORD trusted = SECURITY_FLAG_IGNORE_UNKNOWN_CA | SECURITY_FLAG_IGNORE_CERT_CN_INVALID |
                    SECURITY_FLAG_IGNORE_CERT_DATE_INVALID | SECURITY_FLAG_IGNORE_CERT_WRONG_USAGE;
    return WinHttpSetOption(request_.get(), WINHTTP_OPTION_DISABLE_FEATURE, &without, sizeof without) &&
           (!shared_.check ||
            WinHttpSetOption(request_.get(), WINHTTP_OPTION_SECURITY_FLAGS, &trusted, sizeof trusted)) &&
           WinHttpSetOption(request_.get(), WINHTTP_OPTION_UPGRADE_TO_WEB_SOCKET, nullptr, 0) &&
           WinHttpSendRequest(request_.get(), WINHTTP_NO_ADDITIONAL_HEADERS, 0, WINHTTP_NO_REQUEST_DATA, 0, 0,
                              context);
  }

  void happened(const WinHttpEvent& event) override {
    using Kind = WinHttpEvent::Kind;
    if (ended_) return;
    switch (event.kind) {
      case Kind::sent:
        if (event.certificate && !event.certificate->trusted) return distrust(*event.certificate);
        if (!WinHttpReceiveResponse(request_.get(), nullptr)) end(GetLastError());
        break;
      case Kind::answered:
        return answered();
      case Kind::read:
        return link_->stage == Stage::open ? received(event) : refused(event.bytes);
      case Kind::written:
        return listener_.written();
      case Kind::saidGoodbye:
        if (end_.byServer) end(ERROR_SUCCESS);
        break;
      case Kind::writeFailed:
        return writeFailed(event.error);
      case Kind::failed:
        end(event.error);
        break;
    }
  }

  void distrust(const CertificateCheck::Result& certificate) {
    link_->stage = Stage::tls;
    end_.untrusted = true;
    end_.shownKey = certificate.shownKey;
    end_.why = certificate.why;
    end(ERROR_SUCCESS);
  }

  void answered() {
    DWORD status = 0, bytes = sizeof status;
    if (!WinHttpQueryHeaders(request_.get(), WINHTTP_QUERY_STATUS_CODE | WINHTTP_QUERY_FLAG_NUMBER,
                             WINHTTP_HEADER_NAME_BY_INDEX, &status, &bytes, WINHTTP_NO_HEADER_INDEX))
      return end(GetLastError());
    if (status == kSwitchingProtocols) return upgrade();
    end_.httpStatus = static_cast<int>(status);
    end_.isOurs = header(WINHTTP_QUERY_SERVER) == "clothstream";
    end_.why = firstLine(header(WINHTTP_QUERY_STATUS_TEXT));
    if (!end_.isOurs) return end(ERROR_SUCCESS);
    // The first part of the answer says why.
    link_->incoming.resize(kMaxShownText);
    if (!WinHttpReadData(request_.get(), link_->incoming.data(), kMaxShownText, nullptr)) end(GetLastError());
  }
  // Text of a header field. Empty if the field is missing or longer than kMaxShownText.
  std::string header(DWORD which) const {
    wchar_t text[kMaxShownText];
    DWORD bytes = sizeof text;
    if (!WinHttpQueryHeaders(request_.get(), which, WINHTTP_HEADER_NAME_BY_INDEX, text, &bytes,
                             WINHTTP_NO_HEADER_INDEX))
      return {};
    return utf8({text, bytes / sizeof *text});
  }
  void refused(DWORD bytes) {
    end_.why = firstLine({reinterpret_cast<const char*>(link_->incoming.data()), bytes});
    end(ERROR_SUCCESS);
  }

  void upgrade() {
    link_->stage = Stage::open;
    const DWORD_PTR context = link_->newContext();
    socket_.reset(WinHttpWebSocketCompleteUpgrade(request_.get(), context));
    if (!socket_) {
      const DWORD error = GetLastError();
      WinHttpLink::freeContext(context);
      link_->stage = Stage::upgrade;
      return end(error);
    }
    listener_.opened();
  }

  void receive() {
    auto& buffer = link_->incoming;
    if (filled_ >= kMaxServerMessageBytes) return end(ERROR_BUFFER_OVERFLOW);
    if (filled_ == buffer.size()) buffer.resize(std::max(kFirstBufferBytes, 2 * buffer.size()));
    // Set only by handles that do not call back.
    DWORD bytes = 0;
    WINHTTP_WEB_SOCKET_BUFFER_TYPE type{};
    endUnless(WinHttpWebSocketReceive(socket_.get(), buffer.data() + filled_,
                                      static_cast<DWORD>(buffer.size() - filled_), &bytes, &type));
  }
  void received(const WinHttpEvent& event) {
    filled_ += event.bytes;
    switch (event.type) {
      case WINHTTP_WEB_SOCKET_BINARY_FRAGMENT_BUFFER_TYPE:
      case WINHTTP_WEB_SOCKET_UTF8_FRAGMENT_BUFFER_TYPE:
        return receive();
      case WINHTTP_WEB_SOCKET_CLOSE_BUFFER_TYPE:
        return leftByServer();
      case WINHTTP_WEB_SOCKET_BINARY_MESSAGE_BUFFER_TYPE:
      case WINHTTP_WEB_SOCKET_UTF8_MESSAGE_BUFFER_TYPE:
        break;
    }
    reading_ = false;
    swap(message_, link_->incoming);
    listener_.received({message_.data(), filled_});
  }

  // A read that is under way ends too, and tells why: a close frame of the server aborts the write.
  void writeFailed(DWORD error) {
    if (!reading_) end(error);
  }

  void sayGoodbye() {
    saidGoodbye_ = true;
    endUnless(WinHttpWebSocketShutdown(socket_.get(), kNormalClosure, nullptr, 0));
  }
  // Answers with a close frame, unless this is the answer to one.
  void leftByServer() {
    USHORT code = 0;
    char why[WINHTTP_WEB_SOCKET_MAX_CLOSE_REASON_LENGTH];
    DWORD bytes = 0;
    if (WinHttpWebSocketQueryCloseStatus(socket_.get(), &code, why, sizeof why, &bytes) == NO_ERROR)
      end_.why = firstLine({why, bytes});
    end_.byServer = true;
    saidGoodbye_ ? end(ERROR_SUCCESS) : sayGoodbye();
  }

  // Result of a WebSocket function, which returns its error.
  void endUnless(DWORD error) {
    if (error != NO_ERROR) end(error);
  }
  // ERROR_SUCCESS: end_ says why.
  void end(DWORD error) {
    if (std::exchange(ended_, true)) return;
    link_->detach();
    end_.stage = isOfTls(error) ? Stage::tls : link_->stage.load();
    if (error != ERROR_SUCCESS && !end_.byServer) end_.why = windowsErrorText(error);
    socket_.reset();
    request_.reset();
    net::post(shared_.io, [this] { listener_.ended(end_); });
  }

  Shared& shared_;
  WebSocketListener& listener_;
  std::shared_ptr<WinHttpLink> link_;
  WinHttpHandle request_, socket_;
  std::vector<std::byte> message_;
  std::size_t filled_ = 0;  // bytes of the message that is read
  WebSocketEnd end_;
  bool reading_ = false, saidGoodbye_ = false, ended_ = false;
};

}  // namespace

WebSocketConnector::WebSocketConnector(net::io_context& io, const ServerAddress& server)
    : shared_(std::make_unique<Shared>(io, server)) {}

WebSocketConnector::~WebSocketConnector() = default;

void WebSocketConnector::goTo(const ServerAddress& server) {
  shared_->goTo(server);
}

std::unique_ptr<WebSocketConnection> WebSocketConnector::open(WebSocketListener& listener) {
  return std::make_unique<Connection<Shared>>(*shared_, listener);
}

}  // namespace clothstream
