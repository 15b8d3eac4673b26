"""Names that common headers define as macros. Emitted C uses none of them, so any header may be included before it.

Taken from the published headers: Arduino.h, binary.h, Print.h and WString.h of arduino/ArduinoCore-avr and
Arduino_Core_STM32; minwindef.h, rpcndr.h, windef.h and winnt.h of mingw-w64; core_cm*.h of ARM-software/CMSIS_5 and
CMSIS_6 with the device headers of STMicroelectronics/STM32CubeF4; sys/util.h, sys/util_macro.h and toolchain.h of
zephyrproject-rtos/zephyr; esp_bit_defs.h and esp_attr.h of espressif/esp-idf; the keywords of the language extensions
of the IAR, TI and Microchip (XC8) compilers. Types and enumerators are listed too if -Wshadow would report them.
`test_foreign_names.py` reads the headers of Windows, AVR, C and POSIX directly, since tools of the tests ship them.
"""

from __future__ import annotations


def words(text: str) -> frozenset[str]:
    """Set of the words of a text."""
    return frozenset(text.split())


def _numbered(text: str, last: int) -> frozenset[str]:
    return frozenset(f"{word}{k}" for word in text.split() for k in range(last + 1))


WINDOWS = words(
    """
    near far NEAR FAR huge pascal PASCAL cdecl CDECL small hyper interface IN OUT OPTIONAL CONST VOID BOOL TRUE FALSE
    BYTE WORD DWORD INT UINT CHAR SHORT LONG FLOAT min max STRICT WIN32 CALLBACK WINAPI WINAPIV APIENTRY APIPRIVATE
    MAKEWORD MAKELONG LOWORD HIWORD LOBYTE HIBYTE MAX_PATH DELETE ERROR NO_ERROR IGNORE DIFFERENCE OPAQUE TRANSPARENT
    ABSOLUTE RELATIVE INFINITE THIS THIS_ PURE STDMETHOD DECLARE_HANDLE TEXT UNICODE environ
    """
)

ARDUINO = words(
    """
    HIGH LOW INPUT OUTPUT INPUT_PULLUP INPUT_PULLDOWN PI HALF_PI TWO_PI DEG_TO_RAD RAD_TO_DEG EULER SERIAL DISPLAY
    LSBFIRST MSBFIRST CHANGE FALLING RISING DEFAULT EXTERNAL INTERNAL INTERNAL1V1 INTERNAL2V56 min max abs constrain
    round radians degrees sq map interrupts noInterrupts clockCyclesPerMicrosecond clockCyclesToMicroseconds
    microsecondsToClockCycles lowByte highByte bitRead bitSet bitClear bitToggle bitWrite bit word byte boolean
    analogInPinToBit digitalPinToPort digitalPinToBitMask digitalPinToTimer portOutputRegister portInputRegister
    portModeRegister NOT_A_PIN NOT_A_PORT NOT_AN_INTERRUPT NOT_ON_TIMER DEC HEX OCT BIN F PSTR PROGMEM _NOP _BV sbi cbi
    SDA SCL MOSI MISO SCK SS LED_BUILTIN Serial Wire SPI EEPROM F_CPU ARDUINO ICACHE_RAM_ATTR IRAM_ATTR
    """
) | words(" ".join(f"B{k:0{digits}b}" for digits in range(1, 9) for k in range(2**digits)))

CMSIS = words(
    """
    __I __O __IO __IM __OM __IOM __ASM __INLINE __STATIC_INLINE __STATIC_FORCEINLINE __NO_RETURN __USED __WEAK __PACKED
    __ALIGNED __RESTRICT __NOP __WFI __DSB __ISB __DMB _VAL2FLD _FLD2VAL SCB SCnSCB SysTick NVIC ITM DWT TPI CoreDebug
    MPU FPU RESET SET DISABLE ENABLE SUCCESS ERROR UNUSED SET_BIT CLEAR_BIT READ_BIT CLEAR_REG WRITE_REG READ_REG
    MODIFY_REG POSITION_VAL IS_FUNCTIONAL_STATE FLASH PWR RCC EXTI SYSCFG RTC WWDG IWDG CRC DMA1 DMA2 ADC ADC1 ADC2 ADC3
    DAC DAC1 CAN1 CAN2 RNG HASH CRYP DCMI FMC LTDC SDIO OTG GPIOA GPIOB GPIOC GPIOD assert_param DBGMCU I S N M P Q
    """
) | _numbered("TIM SPI I2C USART UART LPTIM", 17)

ZEPHYR = words(
    """
    BIT BIT64 BIT_MASK BIT64_MASK MIN MAX CLAMP IN_RANGE ARRAY_SIZE ARRAY_INDEX ARRAY_INDEX_FLOOR ARRAY_FOR_EACH
    ARRAY_FOR_EACH_PTR IS_ARRAY IS_ARRAY_ELEMENT PART_OF_ARRAY CONTAINER_OF CONTAINER_OF_VALIDATE SAME_TYPE CONCAT
    ROUND_UP ROUND_DOWN WB_UP WB_DN DIV_ROUND_UP DIV_ROUND_CLOSEST ceiling_fraction GENMASK GENMASK64 LSB_GET FIELD_GET
    FIELD_PREP NUM_BITS POINTER_TO_UINT UINT_TO_POINTER POINTER_TO_INT INT_TO_POINTER BITS_PER_LONG BITS_PER_LONG_LONG
    ZERO_OR_COMPILE_ERROR IS_ENABLED IS_EQ IS_EMPTY IS_POWER_OF_TWO COND_CODE_0 COND_CODE_1 IF_ENABLED IF_DISABLED EMPTY
    IDENTITY DEBRACKET LIST_DROP_EMPTY GET_ARG_N GET_ARGS_LESS_N LISTIFY FOR_EACH FOR_EACH_IDX REVERSE_ARGS NUM_VA_ARGS
    NUM_VA_ARGS_LESS_1 MACRO_MAP_CAT UTIL_AND UTIL_OR UTIL_INC UTIL_DEC UTIL_X2 WRITE_BIT SHIFT_RIGHT KB MB GB KHZ MHZ
    BUILD_ASSERT likely unlikely popcount ALWAYS_INLINE CODE_UNREACHABLE ARG_UNUSED STRINGIFY HAS_BUILTIN GPIO_INPUT
    GPIO_OUTPUT FUNC_ALIAS ALIAS_OF DT_ALIAS K_MSEC K_FOREVER SYS_INIT barrier
    """
)

ESP_IDF = _numbered("BIT", 63) | words("BIT BIT64 IRAM_ATTR DRAM_ATTR RTC_DATA_ATTR UNUSED likely unlikely")

COMPILERS = words(
    """
    near far huge tiny interrupt bit bank0 bank1 bank2 bank3 banked persistent eeprom control fortran cregister ioport
    onchip monitor no_init intrinsic saddr callt
    """
)

C_LIBRARY = words(
    """
    I complex imaginary errno assert stdin stdout stderr EOF NAN INFINITY isnan isinf isfinite isnormal signbit
    fpclassify unix linux i386 arm sun major minor makedev st_atime sa_handler si_value s6_addr d_ino h_addr alloca
    va_start va_end setjmp and or not xor bitand bitor compl
    """
)

NAMES = WINDOWS | ARDUINO | CMSIS | ZEPHYR | ESP_IDF | COMPILERS | C_LIBRARY
