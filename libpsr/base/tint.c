#include "psr/tint.h"
#include <string.h>

void psr_ramp_color(uint8_t rgb[3], unsigned step)
{
	static const uint8_t knot[9][3] = { { 68, 1, 84 }, { 72, 40, 120 }, { 59, 82, 139 }, { 44, 114, 142 },
		                                { 33, 145, 140 }, { 40, 174, 128 }, { 94, 201, 98 }, { 173, 220, 48 },
		                                { 253, 231, 37 } };
	const unsigned most = PSR_RAMP - 1, at = (step < most ? step : most) * 8, k = at / most < 8 ? at / most : 7;
	const unsigned part = at - k * most;

	for (int c = 0; c < 3; c++)
		rgb[c] = (uint8_t)((knot[k][c] * (most - part) + knot[k + 1][c] * part + most / 2) / most);
}

static const struct {
	uint8_t rgb[3];
	const char *name;
} classes[] = {
	{ { 160, 160, 160 }, "never classified" }, { { 205, 205, 205 }, "unclassified" }, { { 168, 112, 50 }, "ground" },
	{ { 178, 223, 110 }, "low vegetation" }, { { 96, 186, 70 }, "medium vegetation" },
	{ { 20, 122, 46 }, "high vegetation" }, { { 232, 92, 60 }, "building" }, { { 255, 0, 170 }, "low noise" },
	{ { 222, 170, 110 }, "model key point" }, { { 46, 120, 220 }, "water" }, { { 110, 70, 160 }, "rail" },
	{ { 84, 84, 96 }, "road surface" }, { { 240, 220, 130 }, "overlap" }, { { 245, 215, 30 }, "wire guard" },
	{ { 255, 165, 0 }, "wire conductor" }, { { 150, 30, 60 }, "transmission tower" },
	{ { 255, 120, 120 }, "wire connector" }, { { 90, 150, 170 }, "bridge deck" }, { { 200, 0, 255 }, "high noise" },
	{ { 130, 100, 90 }, "overhead structure" }, { { 120, 90, 30 }, "ignored ground" }, { { 235, 245, 255 }, "snow" },
	{ { 0, 200, 200 }, "temporal exclusion" },
};

#define N_NAMED (sizeof classes / sizeof classes[0])
#define FIRST_OF_USERS 64

/* Classes without a colour of their own share eight, so that neighbours differ. */
void psr_class_color(uint8_t rgb[3], unsigned class_code)
{
	static const uint8_t open[8][3] = { { 102, 194, 165 }, { 252, 141, 98 }, { 141, 160, 203 }, { 231, 138, 195 },
		                                { 166, 216, 84 }, { 255, 217, 47 }, { 229, 196, 148 }, { 179, 179, 179 } };

	memcpy(rgb, class_code < N_NAMED ? classes[class_code].rgb : open[class_code % 8], 3);
}

const char *psr_class_name(unsigned class_code)
{
	return class_code < N_NAMED ? classes[class_code].name : class_code < FIRST_OF_USERS ? "reserved" : "user";
}

static const struct {
	uint8_t rgb[3];
	const char *name;
} orders[PSR_N_RETURN_ORDERS] = {
	[PSR_RETURN_ONLY] = { { 200, 200, 200 }, "only return" },
	[PSR_RETURN_FIRST] = { { 60, 180, 75 }, "first of several" },
	[PSR_RETURN_BETWEEN] = { { 245, 190, 40 }, "between" },
	[PSR_RETURN_LAST] = { { 70, 110, 220 }, "last of several" },
};

void psr_order_color(uint8_t rgb[3], enum psr_return_order order)
{
	memcpy(rgb, orders[order].rgb, 3);
}

const char *psr_order_name(enum psr_return_order order)
{
	return orders[order].name;
}
