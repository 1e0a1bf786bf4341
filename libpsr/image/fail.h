// Errors of the image module's writers.
#ifndef PSR_IMAGE_FAIL_H
#define PSR_IMAGE_FAIL_H

#include <cstdio>
#include <exception>
#include <string>

// Copies the text, without control characters, to a message of `size` bytes. Returns 1, a writer's failure.
inline int fail(char *message, unsigned size, const std::string &text)
{
	std::string clean = text;

	for (char &c : clean)
		if (static_cast<unsigned char>(c) < 32)
			c = ' ';
	std::snprintf(message, size, "%s", clean.c_str());
	return 1;
}

// Calls a writer; an exception becomes its failure.
template <typename F> int guard(char *message, unsigned size, F function)
{
	try {
		return function();
	} catch (const std::exception &e) {
		return fail(message, size, e.what());
	} catch (...) {
		return fail(message, size, "OpenImageIO failed");
	}
}

#endif
