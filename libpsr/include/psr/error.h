/* Error codes and error texts, shared by every part.
 *
 * A function that can fail returns an int: PSR_OK or one of the negative codes below. Its last parameter `struct
 * psr_error *err` may be NULL; on failure it gets the code and one sentence that says what was wrong, where, and what
 * to do. Success leaves it alone. A failing call leaves nothing to free: *out is as it was, or NULL. */
#ifndef PSR_ERROR_H
#define PSR_ERROR_H

#ifdef __cplusplus
extern "C" {
#endif

enum psr_err {
	PSR_OK = 0,
	PSR_ERR_ARG = -1,         /* an argument or option outside of its documented range */
	PSR_ERR_MEMORY = -2,      /* an allocation failed */
	PSR_ERR_IO = -3,          /* the system refused to read or write: permission, disk full, ... */
	PSR_ERR_NOT_FOUND = -4,   /* no such file, no such model */
	PSR_ERR_FORMAT = -5,      /* corrupt or truncated bytes */
	PSR_ERR_VERSION = -6,     /* a file or a peer of a version that this build does not speak */
	PSR_ERR_UNSUPPORTED = -7, /* well-formed, but asks for a feature that psr lacks */
	PSR_ERR_LIMIT = -8,       /* over a documented limit */
	PSR_ERR_BUSY = -9,        /* too much is open already; try again */
	PSR_ERR_CANCELLED = -10,  /* given up on request */
	PSR_ERR_PROTOCOL = -11,   /* the peer broke the protocol */
	PSR_ERR_CONNECTION = -12, /* the peer cannot be reached, or went away */
	PSR_ERR_INTERNAL = -13,   /* a defect of psr itself */
};

#define PSR_ERROR_TEXT 512

struct psr_error {
	int code;                  /* enum psr_err */
	char text[PSR_ERROR_TEXT]; /* NUL-terminated, no newline at the end */
};

/* A short name of a code ("not found"); never NULL. */
const char *psr_strerror(int code);

/* The exit status for a program that ends with this code; the man pages list them: 0 ok, 1 a check failed, 2 usage, 3
 * file or system, 4 bad data, 5 over a limit, 6 server or connection, 7 internal. */
int psr_exit_status(int code);

/* Fills err (unless NULL) and returns code, so that a failing function can `return psr_fail(...)`. */
int psr_fail(struct psr_error *err, int code, const char *format, ...) __attribute__((format(printf, 3, 4)));

#ifdef __cplusplus
}
#endif
#endif
