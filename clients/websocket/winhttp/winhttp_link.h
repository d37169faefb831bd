// SPDX-License-Identifier: MIT
// Brings what the threads of WinHTTP report to the thread of an io_context.
#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <windows.h>
#include <winhttp.h>

#include "clients/websocket/web_socket_connection.h"
#include "clients/websocket/winhttp/certificate_check.h"

namespace clothstream {

struct WinHttpEvent {
  enum class Kind {
    sent,         // the request; with TLS, `certificate` is about its receiver
    answered,     // the headers of the answer have arrived
    read,         // `bytes` of the answer's body, or of a message or close frame (`type`)
    written,      // a message
    saidGoodbye,  // a close frame was sent
    writeFailed,  // `error` says why
    failed,       // likewise: anything else
  };
  Kind kind = Kind::failed;
  DWORD error = ERROR_SUCCESS, bytes = 0;
  WINHTTP_WEB_SOCKET_BUFFER_TYPE type = WINHTTP_WEB_SOCKET_BINARY_MESSAGE_BUFFER_TYPE;
  std::optional<CertificateCheck::Result> certificate{};
};

class WinHttpListener {
 public:
  virtual void happened(const WinHttpEvent& event) = 0;

 protected:
  ~WinHttpListener() = default;
};

// Belongs to a connection and to the handles that it opens, whichever ends last: WinHTTP uses the buffers
// until it has closed a handle. The public members belong to the thread of the io_context, except while
// WinHTTP uses them.
class WinHttpLink : public std::enable_shared_from_this<WinHttpLink> {
 public:
  // `check`: without TLS nullptr. The listener is called on the io_context until detach().
  WinHttpLink(boost::asio::io_context& io, std::shared_ptr<const CertificateCheck> check,
              WinHttpListener& listener);

  // Callback of all handles.
  static void CALLBACK called(HINTERNET handle, DWORD_PTR context, DWORD status, void* about,
                              DWORD bytes) noexcept;
  // Context for the callbacks of one handle, which frees it when it closes. A handle that could not be opened
  // does not: then call freeContext().
  DWORD_PTR newContext();
  static void freeContext(DWORD_PTR context);

  void detach();

  std::atomic<WebSocketEnd::Stage> stage{WebSocketEnd::Stage::lookup};
  std::vector<std::byte> incoming;
  std::string outgoing;

 private:
  void notified(HINTERNET handle, DWORD status, const void* about, DWORD bytes);
  CertificateCheck::Result checkCertificate(HINTERNET request) const;
  void post(WinHttpEvent event);

  const std::shared_ptr<const CertificateCheck> check_;
  WinHttpListener* listener_;  // belongs to the thread of the io_context
  std::mutex mutex_;
  boost::asio::io_context* io_;  // guarded by the mutex; nullptr after detach()
};

}  // namespace clothstream
